# Cross-compiles to WebAssembly: Debian's clang 19 with the C and C++ libraries of npm's @yowasp/clang, which
# `./dev web` unpacks into QUOIN_WEB_ROOT. Those libraries are built without exceptions: see apps/web/runtime.cpp.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR wasm32)
set(CMAKE_C_COMPILER clang-19)
set(CMAKE_CXX_COMPILER clang++-19)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES QUOIN_WEB_ROOT)
set(CMAKE_C_COMPILER_TARGET wasm32-wasip1)
set(CMAKE_CXX_COMPILER_TARGET wasm32-wasip1)
set(quoin_web_headers "-isystem ${QUOIN_WEB_ROOT}/sysroot/include/wasm32-wasip1 -isystem ${QUOIN_WEB_ROOT}/headers")
set(CMAKE_C_FLAGS_INIT "-nostdlibinc ${quoin_web_headers} -msimd128")
# An exception ends the instance with its text, so unwinding code is not needed.
string(CONCAT CMAKE_CXX_FLAGS_INIT "-nostdinc++ -nostdlibinc -isystem ${QUOIN_WEB_ROOT}/sysroot/include/c++/v1 "
  "${quoin_web_headers} -msimd128 -fexceptions -fignore-exceptions")
