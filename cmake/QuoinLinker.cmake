# Selects the fastest available linker for Quoin's own builds, which link the library into some 20 programs.

include(CheckLinkerFlag)

set(quoin_linkers ${QUOIN_LINKER})
if(QUOIN_LINKER STREQUAL "auto")
  set(quoin_linkers)
  if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_LINKER_TYPE AND NOT "${CMAKE_EXE_LINKER_FLAGS}" MATCHES "-fuse-ld=")
    set(quoin_linkers mold lld)
  endif()
elseif(QUOIN_LINKER STREQUAL "default")
  set(quoin_linkers)
endif()

foreach(linker ${quoin_linkers})
  check_linker_flag(CXX "-fuse-ld=${linker}" QUOIN_LINKS_WITH_${linker})
  if(QUOIN_LINKS_WITH_${linker})
    add_link_options("-fuse-ld=${linker}")
    break()
  elseif(NOT QUOIN_LINKER STREQUAL "auto")
    message(FATAL_ERROR "the compiler cannot link with QUOIN_LINKER ${linker}")
  endif()
endforeach()
