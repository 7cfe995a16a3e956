# Kernels are compiled once for each instruction set and chosen at run time: x_plain.cpp with the build's own flags,
# x_avx2.cpp and x_avx512.cpp with those below. These two define everything except their entry points with internal
# linkage. Otherwise a linker might use one of their inline functions in the whole program, which would then fail on
# machines without the instructions. tests/kernels checks the objects.

set(quoin_avx2_flags -mavx2 -mbmi -mbmi2 -mpopcnt)
set(quoin_avx512_flags ${quoin_avx2_flags} -mavx512f -mavx512bw -mavx512dq -mavx512vl)

if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64" AND NOT MSVC)
  set(quoin_x86_kernels TRUE)
else()
  set(quoin_x86_kernels FALSE)
endif()

# Usage: quoin_kernel(x [FLAG...]), with additional flags for AVX-512.
function(quoin_kernel stem)
  # Wide vectors never cross a call.
  set(common -Wno-psabi -fno-trapping-math)
  set_source_files_properties("${stem}_plain.cpp" PROPERTIES COMPILE_OPTIONS "${common}" SKIP_PRECOMPILE_HEADERS ON)
  if(NOT quoin_x86_kernels)
    return()
  endif()
  # Unoptimised, they would contain standard library functions that the linker might use elsewhere.
  list(APPEND common $<$<NOT:$<CONFIG:Release>>:-O2>)
  set_source_files_properties("${stem}_avx2.cpp" PROPERTIES
    COMPILE_OPTIONS "${common};${quoin_avx2_flags}" COMPILE_DEFINITIONS QUOIN_KERNEL_AVX2 SKIP_PRECOMPILE_HEADERS ON)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # GCC 12's own header reads a value that is undefined on purpose (GCC bug 105593).
    list(APPEND common -Wno-uninitialized -Wno-maybe-uninitialized)
  endif()
  set_source_files_properties("${stem}_avx512.cpp" PROPERTIES
    COMPILE_OPTIONS "${common};${quoin_avx512_flags};${ARGN}" COMPILE_DEFINITIONS "QUOIN_KERNEL_AVX2;QUOIN_KERNEL_AVX512"
    SKIP_PRECOMPILE_HEADERS ON)
endfunction()
