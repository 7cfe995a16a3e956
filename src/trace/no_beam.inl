// Where lockstep serves packets of every kind as well as beams would, or better: AVX-512.

template <Ask kAsk>
inline Met trace(const TreeView& tree, Lanes& lanes, F t, const Crossing& entered) {
  return trace_apart<kAsk>(tree, lanes, t, entered, {mask_of(0), mask_of(0), all(0), all(0), all(0), all(0)});
}
