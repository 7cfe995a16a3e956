// The pass for any processor.

#include "light/propagated/spread.inl"

namespace quoin::propagated {

const Spread kSpreadPlain = spread;

}  // namespace quoin::propagated
