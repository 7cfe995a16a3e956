# What `cmake --install` puts in place, and the package that find_package(quoin) finds.

include(CMakePackageConfigHelpers)
set(quoin_package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/quoin")

install(TARGETS quoin EXPORT quoin_targets
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(DIRECTORY include/quoin DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
install(EXPORT quoin_targets NAMESPACE quoin:: DESTINATION "${quoin_package_dir}")
get_target_property(quoin_library_type quoin TYPE)
configure_package_config_file(cmake/quoin-config.cmake.in "${CMAKE_CURRENT_BINARY_DIR}/quoin-config.cmake"
  INSTALL_DESTINATION "${quoin_package_dir}")
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/quoin-config-version.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/quoin-config.cmake" "${CMAKE_CURRENT_BINARY_DIR}/quoin-config-version.cmake"
  DESTINATION "${quoin_package_dir}")
# For builds without CMake. The static library needs what it is made of; the shared one brings it along.
file(RELATIVE_PATH quoin_pc_prefix "${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig" "${CMAKE_INSTALL_PREFIX}")
string(REGEX REPLACE "/$" "" quoin_pc_prefix "${quoin_pc_prefix}")
foreach(folder LIBDIR INCLUDEDIR)  # absolute in some distributions
  string(TOLOWER "quoin_pc_${folder}" variable)
  set(${variable} "\${prefix}/${CMAKE_INSTALL_${folder}}")
  if(IS_ABSOLUTE "${CMAKE_INSTALL_${folder}}")
    set(${variable} "${CMAKE_INSTALL_${folder}}")
  endif()
endforeach()
set(quoin_pc_libs "")
if(quoin_library_type STREQUAL "STATIC_LIBRARY")
  set(quoin_pc_libs " -ltbb -lpng -lz -ldl -pthread")
  if(meshoptimizer_FOUND)
    string(PREPEND quoin_pc_libs " -lmeshoptimizer")
  endif()
endif()
set(quoin_pc_cflags "")
if(QUOIN_CHECKED)
  set(quoin_pc_cflags " -DQUOIN_CHECKED")
endif()
configure_file(cmake/quoin.pc.in "${CMAKE_CURRENT_BINARY_DIR}/quoin.pc" @ONLY)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/quoin.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
install(FILES LICENSE NOTICE DESTINATION "${CMAKE_INSTALL_DOCDIR}")
if(QUOIN_BUILD_TOOLS)
  install(TARGETS quoin_tool RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
endif()
