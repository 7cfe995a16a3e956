#pragma once

// Includes the lanes of the instruction set that the including file is compiled for.
#if defined(QUOIN_KERNEL_AVX512)
#include "core/lanes/lanes_avx512.h"
namespace quoin {
namespace lanes = lanes_avx512;
}
#elif defined(QUOIN_KERNEL_AVX2)
#include "core/lanes/lanes_avx2.h"
namespace quoin {
namespace lanes = lanes_avx2;
}
#else
#include "core/lanes/lanes_plain.h"
namespace quoin {
namespace lanes = lanes_plain;
}
#endif
