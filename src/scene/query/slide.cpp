#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/scene/sweep.h>

#include "core/memory/make_room.h"
#include "scene/query/query_in_grid.h"

namespace quoin {
namespace {

// The normals of a moving body's contacts.
using Normals = KeptList<DVec3, struct ContactNormals>;

// Removes from a displacement the components that point into the contacts so far.
DVec3 along_contacts(DVec3 displacement, const std::vector<DVec3>& normals) {
  const auto goes_into = [&](DVec3 d) {
    return std::any_of(normals.begin(), normals.end(),
                       [&](DVec3 normal) { return glm::dot(d, normal) < -1e-9 * glm::length(d); });
  };
  if (!goes_into(displacement)) return displacement;
  for (const DVec3 normal : normals) {
    const DVec3 slid = displacement - glm::dot(displacement, normal) * normal;
    if (glm::dot(displacement, normal) < 0.0 && !goes_into(slid)) return slid;
  }
  for (std::size_t i = 0; i < normals.size(); ++i) {
    for (std::size_t j = i + 1; j < normals.size(); ++j) {
      const DVec3 crease = glm::cross(normals[i], normals[j]);
      const double squared = glm::dot(crease, crease);
      if (squared < 1e-12) continue;
      const DVec3 slid = crease * (glm::dot(displacement, crease) / squared);
      if (!goes_into(slid)) return slid;
    }
  }
  return DVec3(0.0);
}

auto sweep_shape(const SceneTracer& tracer, const OrientedBox& box, DVec3 displacement, const QueryFilter& filter) {
  return sweep_box(tracer, box, displacement, filter);
}
auto sweep_shape(const SceneTracer& tracer, const Capsule& capsule, DVec3 displacement, const QueryFilter& filter) {
  return sweep_capsule(tracer, capsule, displacement, filter);
}

double longest_of(const OrientedBox& box) {
  return 2.0 * std::max({box.half_size.x, box.half_size.y, box.half_size.z});
}
double longest_of(const Capsule& capsule) {
  return 2.0 * (glm::length(capsule.half_axis) + capsule.radius);
}
// Half of it, across.
double thinnest_of(const OrientedBox& box) {
  const DVec3 half = glm::abs(box.half_size);
  return std::min({half.x, half.y, half.z});
}
double thinnest_of(const Capsule& capsule) {
  return capsule.radius;
}

// A shape and the scene in which it moves.
template <class Shape>
struct Body {
  const SceneTracer& tracer;
  const SlideOptions& options;
  Shape shape;
  int* sweeps = nullptr;  // to be counted

  [[nodiscard]] std::optional<SweepHit> sweep(DVec3 displacement) const {
    if (sweeps != nullptr) ++*sweeps;
    return sweep_shape(tracer, shape, displacement, options.filter);
  }
  // Moves the shape to a contact, minus the skin. Returns the fraction of the displacement used. A previous move may
  // have ended within the skin, in a hollow of a field. The shape then moves back by the missing part, or it would be
  // stuck.
  double move_to(const SweepHit& hit, DVec3 displacement) {
    const double speed = -glm::dot(displacement, hit.normal);
    const double back = speed > 0.0 ? options.skin / speed : 0.0;
    const double fraction = std::max(0.0, hit.fraction - back);
    shape.centre += displacement * fraction;
    const double gap = hit.fraction * speed;
    if (fraction == 0.0 && hit.in_field && gap < 0.5 * options.skin) {
      const DVec3 away = hit.normal * (options.skin - gap);
      if (!sweep(away)) shape.centre += away;
    }
    return fraction;
  }
  // Moves the shape out of an initial overlap. Returns false if it stays there.
  bool move_out(const SweepHit& hit) {
    if (!options.pushes_out || hit.is_unloaded) return false;
    const double furthest = options.max_push_out.value_or(longest_of(shape) + hit.depth + options.skin);
    const DVec3 along_normal = hit.normal * (hit.depth + options.skin);
    if (hit.in_field && glm::length(along_normal) <= furthest) {
      Shape moved = shape;
      moved.centre += along_normal;
      if (overlaps(tracer, moved, options.filter).empty()) {
        shape.centre = moved.centre;
        return true;
      }
    }
    const auto away = depenetration(tracer, shape, furthest, options.filter);
    if (!away) return false;
    shape.centre += *away;
    // Adds the skin if there is space for it.
    const double length = glm::length(*away);
    Shape further = shape;
    if (length > 0.0) further.centre += *away * (options.skin / length);
    if (overlaps(tracer, further, options.filter).empty()) shape = further;
    return true;
  }
  // Moves the shape as far as possible. Returns the contact, if any.
  std::optional<SweepHit> advance(DVec3 displacement) {
    const auto hit = sweep(displacement);
    if (!hit) {
      if (is_finite(displacement)) shape.centre += displacement;
    } else if (hit->depth == 0.0) {
      move_to(*hit, displacement);
    }
    return hit;
  }
};

// Records a contact. Floors do not count as obstacles.
void note(SlideResult& result, SlideContact::Kind kind, const SweepHit& hit) {
  if (hit.is_unloaded) {
    kind = SlideContact::Kind::Unloaded;
    result.is_waiting = true;
  }
  result.contacts.push_back({kind, hit});
  if (kind == SlideContact::Kind::Floor) return;
  result.is_blocked = true;
  result.normal = hit.normal;
}

template <class Shape>
void slide(Body<Shape> body, DVec3 displacement, SlideResult& result) {
  result.centre = body.shape.centre;
  result.displacement = displacement;
  body.sweeps = &result.sweeps;
  DVec3 left = displacement;
  Normals list;
  std::vector<DVec3>& normals = *list;
  for (int contact = 0; contact < body.options.max_contacts; ++contact) {
    const auto hit = body.sweep(left);
    if (!hit) {
      if (is_finite(left)) body.shape.centre += left;
      break;
    }
    note(result, hit->depth > 0.0 ? SlideContact::Kind::Inside : SlideContact::Kind::Wall, *hit);
    if (hit->depth > 0.0) {
      if (body.move_out(*hit)) continue;
      if (hit->is_unloaded) displacement = DVec3(0.0);
      break;
    }
    const double fraction = body.move_to(*hit, left);
    normals.push_back(hit->normal);
    left = along_contacts(left * (1.0 - fraction), normals);
    if (left == DVec3(0.0)) break;
  }
  result.displacement = along_contacts(displacement, normals);
  result.centre = body.shape.centre;
}

// A walking body. On a floor its displacement is horizontal: walls deflect it, and the floor raises and lowers it. In
// the air it slides as any other body.
template <class Shape>
class Walk {
 public:
  Walk(const Body<Shape>& body, const FloorOptions& floor, DVec3 up, SlideResult& result)
      : body_(body),
        floor_(floor),
        up_(up),
        steepest_(std::cos(floor.max_slope_degrees * std::numbers::pi / 180.0) - 1e-6),
        result_(result) {
    body_.sweeps = &result_.sweeps;
  }
  Walk(const Walk&) = delete;
  Walk& operator=(const Walk&) = delete;

  void run(DVec3 displacement) {
    displacement_ = displacement;
    if (!find_ground(displacement)) return finish();
    if (is_on_floor_) displacement_ = level(displacement_);
    left_ = displacement_;
    for (int contact = 0; contact < body_.options.max_contacts && left_ != DVec3(0.0); ++contact) {
      const DVec3 way = is_on_floor_ ? along_floor(left_) : left_;
      const auto hit = body_.sweep(way);
      if (!hit) {
        if (is_finite(way)) body_.shape.centre += way;
        break;
      }
      if (!meet(*hit, way)) break;
    }
    if (is_on_floor_) settle();
    finish();
  }

 private:
  [[nodiscard]] bool is_floor(DVec3 normal) const { return glm::dot(normal, up_) >= steepest_; }
  // Unloaded chunks are no floor.
  [[nodiscard]] bool is_floor(const SweepHit& hit) const { return !hit.is_unloaded && is_floor(hit.normal); }
  // Handles an initial overlap. Returns false if the body stays there.
  bool move_out(const SweepHit& hit) {
    note(result_, SlideContact::Kind::Inside, hit);
    if (body_.move_out(hit)) return true;
    if (hit.is_unloaded) displacement_ = DVec3(0.0);
    return false;
  }
  [[nodiscard]] DVec3 level(DVec3 v) const { return v - glm::dot(v, up_) * up_; }
  // Returns a horizontal displacement that follows the slope of the floor.
  [[nodiscard]] DVec3 along_floor(DVec3 v) const {
    return v - up_ * (glm::dot(v, result_.floor_normal) / glm::dot(result_.floor_normal, up_));
  }
  void finish() {
    result_.centre = body_.shape.centre;
    result_.displacement = displacement_;
    result_.is_on_floor = is_on_floor_;
    if (!is_on_floor_) {
      result_.floor_normal = DVec3(0.0);
      result_.floor = {};
    }
  }

  // Moves the body out of overlaps and finds the floor below it. Returns false if the body must not move.
  bool find_ground(DVec3 displacement) {
    const double skin = body_.options.skin;
    const DVec3 down = -up_ * (skin + skin / std::max(steepest_, 0.1));
    for (int contact = 0; contact < body_.options.max_contacts; ++contact) {
      const auto hit = body_.sweep(down);
      if (!hit) return true;
      if (hit->depth == 0.0) {
        is_supported_ = !(glm::dot(displacement, up_) > 0.0);
        if (is_supported_ && is_floor(*hit)) land(*hit);
        return true;
      }
      if (!move_out(*hit)) return false;
    }
    return true;
  }

  void land(const SweepHit& floor) {
    // Contacts with walls in the air count as they do on foot.
    if (!is_on_floor_) make_walls_upright();
    is_on_floor_ = true;
    result_.floor = floor;
    result_.floor_normal = floor.normal;
  }

  [[nodiscard]] bool make_upright(DVec3& wall) const {
    wall = level(wall);
    const double length = glm::length(wall);
    if (!(length > 1e-6)) return false;
    wall /= length;
    return true;
  }

  void make_walls_upright() {
    std::size_t upright = 0;
    for (DVec3 wall : walls_) {
      if (make_upright(wall)) walls_[upright++] = wall;
    }
    walls_.resize(upright);
  }

  // Moves to a contact and redirects the remaining path. Returns false at the end of the path.
  bool meet(const SweepHit& hit, DVec3 way) {
    if (hit.depth > 0.0) return move_out(hit);
    left_ *= 1.0 - body_.move_to(hit, way);
    if (is_floor(hit) && !(glm::dot(displacement_, up_) > 0.0)) {
      note(result_, SlideContact::Kind::Floor, hit);
      land(hit);
      displacement_ = along_contacts(level(displacement_), walls_);
      left_ = along_contacts(level(left_), walls_);
      meets_floor_ = true;
      return true;
    }
    if ((is_supported_ || is_on_floor_) && floor_.step_height > 0.0 && !has_failed_step(hit.normal)) {
      const DVec3 here = body_.shape.centre;
      if (steps(level(left_), hit.normal)) return false;
      failed_steps_->push_back({here, hit.normal});
    }
    note(result_, is_floor(-hit.normal) ? SlideContact::Kind::Ceiling : SlideContact::Kind::Wall, hit);
    is_on_floor_ ? turn_aside(hit.normal) : turn(hit.normal);
    return true;
  }

  // On a floor, walls count as vertical, and so does a ceiling above a rising floor.
  void turn_aside(DVec3 normal) {
    DVec3 wall = normal;
    if (!make_upright(wall)) {
      wall = result_.floor_normal;
      if (!make_upright(wall)) {
        left_ = displacement_ = DVec3(0.0);
        return;
      }
    }
    walls_.push_back(wall);
    left_ = along_contacts(left_, walls_);
    displacement_ = along_contacts(displacement_, walls_);
  }

  // In the air, a push into a slope from the side does not lift the body.
  void turn(DVec3 normal) {
    const auto turned = [&](DVec3 v) {
      const DVec3 slid = along_contacts(v, walls_);
      const DVec3 wall = level(normal);
      const double square = glm::dot(wall, wall);
      if (!(glm::dot(slid, up_) > std::max(glm::dot(v, up_), 0.0)) || square < 1e-12) return slid;
      return along_contacts(v - std::min(glm::dot(v, wall), 0.0) / square * wall, walls_);
    };
    walls_.push_back(normal);
    left_ = turned(left_);
    displacement_ = turned(displacement_);
  }

  // Returns true if a step over a wall was attempted where the body is. In a crease, it meets the same walls several
  // times without moving.
  [[nodiscard]] bool has_failed_step(DVec3 normal) {
    constexpr double kSameWall = 0.99;  // cosine of the angle between its normals
    return std::any_of(failed_steps_->begin(), failed_steps_->end(), [&](const FailedStep& step) {
      return glm::dot(step.normal, normal) > kSameWall &&
             glm::distance(step.centre, body_.shape.centre) <= body_.options.skin;
    });
  }

  // Tries to step up, forward and down onto a floor. On success the remaining path counts as done.
  bool steps(DVec3 ahead, DVec3 normal) {
    const double length = glm::length(ahead);
    if (!(length > 0.0) || glm::dot(ahead, normal) >= 0.0) return false;
    Body<Shape> raised = body_;
    raised.advance(up_ * floor_.step_height);
    const double rise = glm::dot(raised.shape.centre - body_.shape.centre, up_);
    if (!(rise > body_.options.skin)) return false;
    Body<Shape> landed = raised;
    landed.advance(ahead);
    // Fails if the wall continues above.
    if (glm::dot(landed.shape.centre - raised.shape.centre, ahead) < 0.25 * length * length) return false;
    const DVec3 down = -up_ * (rise + 2.0 * body_.options.skin);
    auto ground = landed.advance(down);
    if (!ground || ground->depth > 0.0) return false;
    if (!is_floor(*ground)) {
      // On the edge of the step: the floor may begin slightly further on.
      Body<Shape> further = raised;
      further.advance(ahead * std::max(1.0, thinnest_of(body_.shape) / length));
      ground = further.advance(down);
      if (!ground || ground->depth > 0.0 || !is_floor(*ground)) return false;
      if (glm::dot(further.shape.centre - body_.shape.centre, up_) < body_.options.skin) return false;
    }
    body_.shape.centre = landed.shape.centre;
    displacement_ = level(displacement_);
    left_ = DVec3(0.0);
    meets_floor_ = true;
    note(result_, SlideContact::Kind::Floor, *ground);
    land(*ground);
    return true;
  }

  // Moves down to a nearby floor, if any.
  void settle() {
    const double skin = body_.options.skin;
    const double probe = skin + skin / std::max(steepest_, 0.1);
    const DVec3 down = -up_ * std::max(floor_.snap_distance, probe);
    const auto hit = body_.sweep(down);
    if (hit && hit->depth == 0.0 && is_floor(*hit)) {
      body_.move_to(*hit, down);
      land(*hit);
      return;
    }
    // At the edge of a step, or between a floor and a steeper slope.
    is_on_floor_ = meets_floor_ && hit && hit->fraction * glm::length(down) <= probe;
  }

  struct FailedStep {
    DVec3 centre{0.0};  // of the body
    DVec3 normal{0.0};  // of the wall
  };

  Body<Shape> body_;
  const FloorOptions& floor_;
  DVec3 up_;
  double steepest_;  // minimum of dot(normal, up_) for floors
  SlideResult& result_;
  DVec3 displacement_{0.0};  // total, minus the parts that went into contacts
  DVec3 left_{0.0};          // the remaining path; horizontal on a floor
  Normals walls_list_;
  std::vector<DVec3>& walls_ = *walls_list_;
  KeptList<FailedStep, Walk> failed_steps_;
  bool is_on_floor_ = false;
  bool meets_floor_ = false;   // during the move
  bool is_supported_ = false;  // by a floor or a slope at the start
};

// Keeps the memory of the result's contacts.
template <class Shape>
void move_shape(const SceneTracer& tracer, const Shape& shape, DVec3 displacement, const SlideOptions& options,
                SlideResult& result) {
  QUOIN_ASSERT(options.max_contacts >= 1, "at least one contact");
  std::vector<SlideContact> contacts = std::move(result.contacts);
  contacts.clear();
  result = {};
  result.contacts = std::move(contacts);
  const Body<Shape> body{tracer, options, shape};
  if (options.floor) {
    const double length = glm::length(options.floor->up);
    if (length > 0.0 && std::isfinite(length) && is_finite(displacement)) {
      return Walk<Shape>(body, *options.floor, options.floor->up / length, result).run(displacement);
    }
  }
  slide(body, displacement, result);
}

}  // namespace

SlideResult move_and_slide(const SceneTracer& tracer, const OrientedBox& box, DVec3 displacement,
                           const SlideOptions& options) {
  SlideResult result;
  move_shape(tracer, box, displacement, options, result);
  return result;
}

SlideResult move_and_slide(const SceneTracer& tracer, const Capsule& capsule, DVec3 displacement,
                           const SlideOptions& options) {
  SlideResult result;
  move_shape(tracer, capsule, displacement, options, result);
  return result;
}

void move_and_slide(const SceneTracer& tracer, const OrientedBox& box, DVec3 displacement, const SlideOptions& options,
                    SlideResult& result) {
  move_shape(tracer, box, displacement, options, result);
}

void move_and_slide(const SceneTracer& tracer, const Capsule& capsule, DVec3 displacement, const SlideOptions& options,
                    SlideResult& result) {
  move_shape(tracer, capsule, displacement, options, result);
}

}  // namespace quoin
