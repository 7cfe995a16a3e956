# The Vulkan renderer: its headers and glslc are needed to build it. The loader is looked up when a program runs, so
# that the same program starts where there is none.

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
  message(STATUS "Building without Vulkan: there was no ${quoin_vulkan_missing}")
endif()

# Leaves in the list the sources for what there is.
function(quoin_choose_vulkan_sources sources)
  set(all ${${sources}})
  if(quoin_vulkan_missing)
    set(absent ${all})
    list(FILTER absent INCLUDE REGEX "/render_vk/vulkan_absent\\.cpp$")
    list(FILTER all EXCLUDE REGEX "/render_vk/")
    list(APPEND all ${absent})
  else()
    list(FILTER all EXCLUDE REGEX "/render_vk/vulkan_absent\\.cpp$")
  endif()
  set(${sources} ${all} PARENT_SCOPE)
endfunction()

# Compiles the shaders into lists of numbers that the sources include.
function(quoin_add_vulkan target)
  if(quoin_vulkan_missing)
    set_source_files_properties(src/render_vk/vulkan_absent.cpp PROPERTIES COMPILE_DEFINITIONS
      "QUOIN_VULKAN_MISSING=\"there was no ${quoin_vulkan_missing}\"")
    return()
  endif()
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/shaders")
  file(MAKE_DIRECTORY "${folder}")
  file(GLOB shaders CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/src/render_vk/shaders/*.comp"
    "${CMAKE_CURRENT_SOURCE_DIR}/src/render_vk/shaders/*.vert" "${CMAKE_CURRENT_SOURCE_DIR}/src/render_vk/shaders/*.frag")
  foreach(shader ${shaders})
    cmake_path(GET shader FILENAME name)
    set(output "${folder}/${name}.inc")
    add_custom_command(OUTPUT "${output}"
      COMMAND "${QUOIN_GLSLC}" --target-env=vulkan1.2 -O -mfmt=num -MD -MF "${output}.d" -o "${output}" "${shader}"
      DEPENDS "${shader}" DEPFILE "${output}.d" VERBATIM COMMENT "Compiling shader ${name}")
    list(APPEND outputs "${output}")
  endforeach()
  file(GLOB_RECURSE users CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/src/render_vk/*pipeline*.cpp")
  set_source_files_properties(${users} PROPERTIES OBJECT_DEPENDS "${outputs}")
  target_sources(${target} PRIVATE ${outputs})
  target_include_directories(${target} PRIVATE "${folder}" "${QUOIN_VULKAN_INCLUDE}")
  target_link_libraries(${target} PRIVATE ${CMAKE_DL_LIBS})
  target_compile_definitions(${target} PRIVATE QUOIN_HAVE_VULKAN)
endfunction()
