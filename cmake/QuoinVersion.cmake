# Reads the version from include/quoin/version.h, before project().

set(quoin_version_header "${CMAKE_CURRENT_LIST_DIR}/../include/quoin/version.h")
file(STRINGS "${quoin_version_header}" quoin_version REGEX "^#define QUOIN_VERSION_(MAJOR|MINOR|PATCH) [0-9]+$")
list(TRANSFORM quoin_version REPLACE "^.* " "")
list(JOIN quoin_version "." quoin_version)
if(NOT quoin_version MATCHES "^[0-9]+\\.[0-9]+\\.[0-9]+$")
  message(FATAL_ERROR "${quoin_version_header} does not define the three version numbers")
endif()
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${quoin_version_header}")
