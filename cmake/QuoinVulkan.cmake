# The Vulkan renderer: building it needs the headers and glslc. The loader is opened at run time, so programs also start
# without Vulkan.

find_path(QUOIN_VULKAN_INCLUDE vulkan/vulkan.h)
find_program(QUOIN_GLSLC glslc)
set(quoin_vulkan_missing)
if(NOT QUOIN_VULKAN_INCLUDE)
  list(APPEND quoin_vulkan_missing "the header vulkan/vulkan.h (Debian: libvulkan-dev)")
endif()
if(NOT QUOIN_GLSLC)
  list(APPEND quoin_vulkan_missing "glslc (Debian: glslc)")
endif()
list(JOIN quoin_vulkan_missing " and " quoin_vulkan_missing)
if(quoin_vulkan_missing)
  message(STATUS "Building without Vulkan: ${quoin_vulkan_missing} not found")
endif()

# Removes sources that cannot be built: those in the folders of src/render/vulkan need Vulkan.
function(quoin_choose_vulkan_sources sources)
  set(all ${${sources}})
  if(quoin_vulkan_missing)
    list(FILTER all EXCLUDE REGEX "/render/vulkan/[^/]+/")
  else()
    list(FILTER all EXCLUDE REGEX "/render/vulkan/vulkan_absent\\.cpp$")
  endif()
  set(${sources} ${all} PARENT_SCOPE)
endfunction()

# Compiles the shaders of a folder and its subfolders into number lists, which the target's sources named after `USERS`
# include.
function(quoin_add_shaders target folder)
  cmake_parse_arguments(PARSE_ARGV 2 shaders "" "" "USERS")
  set(outputs)
  set(binary "${CMAKE_CURRENT_BINARY_DIR}/shaders")
  file(MAKE_DIRECTORY "${binary}")
  file(GLOB_RECURSE all CONFIGURE_DEPENDS "${folder}/*.comp" "${folder}/*.vert" "${folder}/*.frag")
  # Optimising takes 5 to 10 s per shader, and drivers optimise again. The speed of checked builds is not measured.
  set(optimised -O)
  if(QUOIN_CHECKED)
    set(optimised)
  endif()
  foreach(shader ${all})
    cmake_path(GET shader FILENAME name)
    set(output "${binary}/${name}.inc")
    add_custom_command(OUTPUT "${output}"
      COMMAND "${QUOIN_GLSLC}" --target-env=vulkan1.2 ${optimised} -mfmt=num -I "${folder}" -MD -MF "${output}.d" -o "${output}" "${shader}"
      DEPENDS "${shader}" DEPFILE "${output}.d" VERBATIM COMMENT "Compiling shader ${name}")
    list(APPEND outputs "${output}")
  endforeach()
  set_source_files_properties(${shaders_USERS} PROPERTIES OBJECT_DEPENDS "${outputs}")
  target_sources(${target} PRIVATE ${outputs})
  target_include_directories(${target} PRIVATE "${binary}" "${QUOIN_VULKAN_INCLUDE}")
endfunction()

function(quoin_add_vulkan target)
  if(quoin_vulkan_missing)
    set_source_files_properties(src/render/vulkan/vulkan_absent.cpp PROPERTIES COMPILE_DEFINITIONS
      "QUOIN_VULKAN_MISSING=\"there was no ${quoin_vulkan_missing}\"")
    return()
  endif()
  file(GLOB_RECURSE users CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/src/render/vulkan/*pipeline*.cpp")
  list(APPEND users "${CMAKE_CURRENT_SOURCE_DIR}/src/render/vulkan/paths/path_pass.cpp")
  quoin_add_shaders(${target} "${CMAKE_CURRENT_SOURCE_DIR}/src/render/shaders" USERS ${users})
  target_link_libraries(${target} PRIVATE ${CMAKE_DL_LIBS})
  target_compile_definitions(${target} PRIVATE QUOIN_HAVE_VULKAN)
endfunction()
