// The pass for any processor.

#include "light/propagated/spread.inl"

namespace quoin::propagated {

const SpreadKernel kSpreadPlain{spread, replace};

}  // namespace quoin::propagated
