// A function of the whole program, compiled for wide instructions: tests/kernels/check must find it.

inline void add_one(float* values) {
  for (int i = 0; i < 64; ++i) values[i] += 1.0F;
}

// Taking its address keeps it from being inlined.
using Kernel = void (*)(float*);
extern const Kernel kLeakingKernel;
const Kernel kLeakingKernel = add_one;
