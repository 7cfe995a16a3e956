# Installs Quoin into an empty folder, then configures, builds and runs projects that use it.
# Called with -DBUILD_DIR, -DSOURCE_DIR, -DWORK_DIR, -DCOMPILER, -DHAS_STORE.

function(step)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "failed: ${ARGN}\n${output}")
  endif()
endfunction()

# Configures and builds a project of this folder. Usage: build(NAME [-DVARIABLE...])
function(build name)
  file(COPY "${SOURCE_DIR}/tests/install/${name}" DESTINATION "${WORK_DIR}")
  step("${CMAKE_COMMAND}" -G Ninja -S "${WORK_DIR}/${name}" -B "${WORK_DIR}/build/${name}" -DCMAKE_BUILD_TYPE=Release
    "-DCMAKE_PREFIX_PATH=${WORK_DIR}/prefix" ${ARGN})
  step("${CMAKE_COMMAND}" --build "${WORK_DIR}/build/${name}")
endfunction()

# Builds the same program without CMake. Usage: build_plainly(NAME PACKAGE)
function(build_plainly name package)
  file(GLOB_RECURSE found "${WORK_DIR}/prefix/*/${package}.pc")
  get_filename_component(folder "${found}" DIRECTORY)
  set(flags "$('${pkg_config}' --cflags --libs ${package})")
  step("${CMAKE_COMMAND}" -E env "PKG_CONFIG_PATH=${folder}" sh -c
    "${COMPILER} -std=c++20 '${WORK_DIR}/${name}/main.cpp' ${flags} -o '${WORK_DIR}/plain_${name}'")
endfunction()

file(REMOVE_RECURSE "${WORK_DIR}")
file(MAKE_DIRECTORY "${WORK_DIR}")
step("${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${WORK_DIR}/prefix")
build(consumer)
step("${WORK_DIR}/build/consumer/consumer")
# A game needs no library for images, meshes or archives, nor their CMake packages.
build(streams -DCMAKE_DISABLE_FIND_PACKAGE_PNG=ON -DCMAKE_DISABLE_FIND_PACKAGE_ZLIB=ON
  -DCMAKE_DISABLE_FIND_PACKAGE_OpenEXR=ON)
step("${SOURCE_DIR}/tests/install/check_libraries" "${WORK_DIR}/build/streams/streams")
if(HAS_STORE)
  step("${WORK_DIR}/build/streams/streams" "${WORK_DIR}/streams.quoin")
endif()
find_program(pkg_config pkg-config)
if(pkg_config)
  build_plainly(consumer quoin)
  step("${WORK_DIR}/plain_consumer")
  build_plainly(streams quoin_core)
  step("${SOURCE_DIR}/tests/install/check_libraries" "${WORK_DIR}/plain_streams")
endif()
step("${WORK_DIR}/prefix/bin/quoin" --help)
