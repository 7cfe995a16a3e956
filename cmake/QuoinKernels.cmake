# Kernels are compiled once for each instruction set and chosen at run time: x_plain.cpp with the build's own flags,
# x_avx2.cpp and x_avx512.cpp with those below. Whatever these two define, but for their entry points, has internal
# linkage: else a linker might take an inline function of theirs for the whole program, which then fails on machines
# that lack the instructions. tests/kernels looks at the objects.

set(quoin_avx2_flags -mavx2 -mbmi -mbmi2 -mpopcnt)
set(quoin_avx512_flags ${quoin_avx2_flags} -mavx512f -mavx512bw -mavx512dq -mavx512vl)

if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64" AND NOT MSVC)
  set(quoin_x86_kernels TRUE)
else()
  set(quoin_x86_kernels FALSE)
endif()

# Usage: quoin_kernel(x [FLAG...]), with the flags that AVX-512 takes besides.
function(quoin_kernel stem)
  # Wide vectors never cross a call.
  set(common -Wno-psabi -fno-trapping-math)
  set_source_files_properties("${stem}_plain.cpp" PROPERTIES COMPILE_OPTIONS "${common}" SKIP_PRECOMPILE_HEADERS ON)
  if(NOT quoin_x86_kernels)
    return()
  endif()
  # Unoptimised, what they use of the standard library would be there for the linker to take.
  list(APPEND common $<$<NOT:$<CONFIG:Release>>:-O2>)
  set_source_files_properties("${stem}_avx2.cpp" PROPERTIES
    COMPILE_OPTIONS "${common};${quoin_avx2_flags}" COMPILE_DEFINITIONS QUOIN_KERNEL_AVX2 SKIP_PRECOMPILE_HEADERS ON)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # GCC 12's own header reads what it leaves undefined on purpose (GCC bug 105593).
    list(APPEND common -Wno-uninitialized -Wno-maybe-uninitialized)
  endif()
  set_source_files_properties("${stem}_avx512.cpp" PROPERTIES
    COMPILE_OPTIONS "${common};${quoin_avx512_flags};${ARGN}" COMPILE_DEFINITIONS "QUOIN_KERNEL_AVX2;QUOIN_KERNEL_AVX512"
    SKIP_PRECOMPILE_HEADERS ON)
endfunction()
