#include <quoin/core/changes.h>

#include "core/edit_notices.h"

namespace quoin {

void EditNotice::give_first() {
  to_->give(index_);
  is_given_ = true;
}

}  // namespace quoin
