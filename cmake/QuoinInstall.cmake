# Installs Quoin with `cmake --install`, including the package for find_package(quoin).

include(CMakePackageConfigHelpers)
set(quoin_package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/quoin")

install(TARGETS quoin_core quoin EXPORT quoin_targets
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(DIRECTORY include/quoin DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
install(EXPORT quoin_targets NAMESPACE quoin:: DESTINATION "${quoin_package_dir}")
get_target_property(quoin_library_type quoin TYPE)
configure_package_config_file(cmake/quoin-config.cmake.in "${CMAKE_CURRENT_BINARY_DIR}/quoin-config.cmake"
  INSTALL_DESTINATION "${quoin_package_dir}")
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/quoin-config-version.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/quoin-config.cmake" "${CMAKE_CURRENT_BINARY_DIR}/quoin-config-version.cmake"
  DESTINATION "${quoin_package_dir}")
# For builds without CMake: quoin.pc and quoin_core.pc. Static libraries need their dependencies; shared ones include
# them.
file(RELATIVE_PATH quoin_pc_prefix "${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig" "${CMAKE_INSTALL_PREFIX}")
string(REGEX REPLACE "/$" "" quoin_pc_prefix "${quoin_pc_prefix}")
foreach(folder LIBDIR INCLUDEDIR)  # absolute in some distributions
  string(TOLOWER "quoin_pc_${folder}" variable)
  set(${variable} "\${prefix}/${CMAKE_INSTALL_${folder}}")
  if(IS_ABSOLUTE "${CMAKE_INSTALL_${folder}}")
    set(${variable} "${CMAKE_INSTALL_${folder}}")
  endif()
endforeach()
set(quoin_pc_cflags "")
if(QUOIN_CHECKED)
  set(quoin_pc_cflags " -DQUOIN_CHECKED")
endif()

# Usage: quoin_install_pc(NAME DESCRIPTION REQUIRES LIBS), with the libraries of the static library
function(quoin_install_pc name description requires libs)
  set(quoin_pc_name "${name}")
  set(quoin_pc_description "${description}")
  set(quoin_pc_requires "${requires}")
  set(quoin_pc_libs "")
  if(quoin_library_type STREQUAL "STATIC_LIBRARY")
    set(quoin_pc_libs " ${libs}")
  endif()
  configure_file(cmake/quoin.pc.in "${CMAKE_CURRENT_BINARY_DIR}/${name}.pc" @ONLY)
  install(FILES "${CMAKE_CURRENT_BINARY_DIR}/${name}.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
endfunction()

set(quoin_pc_core_libs "-ltbb -ldl -pthread")
if(NOT quoin_store_missing)
  string(PREPEND quoin_pc_core_libs "-lsqlite3 -lzstd ")
endif()
if(meshoptimizer_FOUND)
  string(PREPEND quoin_pc_core_libs "-lmeshoptimizer ")
endif()
get_target_property(quoin_pc_format_libs quoin QUOIN_PC_LIBS)
quoin_install_pc(quoin_core "A voxel engine: grids, meshes, rays, images, worlds on disk, streaming" ""
  "${quoin_pc_core_libs}")
set(quoin_pc_core quoin_core)
if(BUILD_SHARED_LIBS)
  set(quoin_pc_core "")
endif()
quoin_install_pc(quoin "A voxel engine: quoin_core, and the formats of its files" "${quoin_pc_core}"
  "-Wl,-u,quoin_store_formats ${quoin_pc_format_libs}")
install(FILES LICENSE NOTICE DESTINATION "${CMAKE_INSTALL_DOCDIR}")
if(QUOIN_BUILD_TOOLS)
  install(TARGETS quoin_tool RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
endif()
