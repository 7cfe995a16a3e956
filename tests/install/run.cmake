# Installs Quoin into an empty folder, then configures, builds and runs a project that uses it.
# Called with -DBUILD_DIR, -DSOURCE_DIR, -DWORK_DIR, -DCOMPILER, -DHAS_STORE.

function(step)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "failed: ${ARGN}\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE "${WORK_DIR}")
file(MAKE_DIRECTORY "${WORK_DIR}")
file(COPY "${SOURCE_DIR}/tests/install/consumer" DESTINATION "${WORK_DIR}")
step("${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${WORK_DIR}/prefix")
step("${CMAKE_COMMAND}" -G Ninja -S "${WORK_DIR}/consumer" -B "${WORK_DIR}/build" -DCMAKE_BUILD_TYPE=Release
  "-DCMAKE_PREFIX_PATH=${WORK_DIR}/prefix")
step("${CMAKE_COMMAND}" --build "${WORK_DIR}/build")
step("${WORK_DIR}/build/consumer")
# A game needs no library that reads images, meshes or archives. Worlds on disk are missing in builds without SQLite.
if(HAS_STORE)
  step("${WORK_DIR}/build/streams" "${WORK_DIR}/streams.quoin")
endif()
step("${SOURCE_DIR}/tests/install/check_libraries" "${WORK_DIR}/build/streams")
# The same program without CMake.
find_program(pkg_config pkg-config)
if(pkg_config)
  file(GLOB_RECURSE found "${WORK_DIR}/prefix/*/quoin.pc")
  get_filename_component(folder "${found}" DIRECTORY)
  step("${CMAKE_COMMAND}" -E env "PKG_CONFIG_PATH=${folder}" sh -c
    "${COMPILER} -std=c++20 '${WORK_DIR}/consumer/main.cpp' $('${pkg_config}' --cflags --libs quoin) -o '${WORK_DIR}/plain'")
  step("${WORK_DIR}/plain")
  step("${CMAKE_COMMAND}" -E env "PKG_CONFIG_PATH=${folder}" sh -c
    "${COMPILER} -std=c++20 '${WORK_DIR}/consumer/streams.cpp' $('${pkg_config}' --cflags --libs quoin_core) -o '${WORK_DIR}/plain_streams'")
  step("${SOURCE_DIR}/tests/install/check_libraries" "${WORK_DIR}/plain_streams")
endif()
step("${WORK_DIR}/prefix/bin/quoin" --help)
