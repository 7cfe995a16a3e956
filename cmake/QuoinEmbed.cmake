# Embeds text files as string literals, which sources include as NAME.inc. As a script,
# `cmake -DINPUT=FILE -DOUTPUT=FILE -P QuoinEmbed.cmake` writes one literal.
if(CMAKE_SCRIPT_MODE_FILE)
  file(READ "${INPUT}" text)
  file(WRITE "${OUTPUT}" "R\"quoin(${text})quoin\"\n")
  return()
endif()

set(quoin_embed_script "${CMAKE_CURRENT_LIST_FILE}")

# Usage: quoin_embed(TARGET PREFIX FILES file... USERS source...): embeds each file as PREFIX_NAME.inc.
function(quoin_embed target prefix)
  cmake_parse_arguments(PARSE_ARGV 2 embed "" "" "FILES;USERS")
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/embedded")
  file(MAKE_DIRECTORY "${folder}")
  set(outputs)
  foreach(input ${embed_FILES})
    cmake_path(GET input FILENAME name)
    set(output "${folder}/${prefix}_${name}.inc")
    add_custom_command(OUTPUT "${output}"
      COMMAND "${CMAKE_COMMAND}" "-DINPUT=${input}" "-DOUTPUT=${output}" -P "${quoin_embed_script}"
      DEPENDS "${input}" "${quoin_embed_script}" VERBATIM COMMENT "Embedding ${name}")
    list(APPEND outputs "${output}")
  endforeach()
  set_property(SOURCE ${embed_USERS} APPEND PROPERTY OBJECT_DEPENDS "${outputs}")
  target_sources(${target} PRIVATE ${outputs})
  target_include_directories(${target} PRIVATE "${folder}")
endfunction()

# Embeds the tables of Quoin's own block pack (src/io/packs/data). `root`: the top of the repository.
function(quoin_embed_block_pack target root)
  set(tables families rules textures emission node_families node_rules node_tiles)
  list(TRANSFORM tables REPLACE "(.+)" "${root}/src/io/packs/data/\\1.json")
  quoin_embed(${target} block_pack FILES ${tables}
    USERS "${root}/src/io/packs/pack_own.cpp" "${root}/src/io/packs/node_pack.cpp")
endfunction()

# Embeds the page of maps (src/map/page) and Leaflet, which shows it. Without Leaflet, maps have no page.
function(quoin_embed_map_page target root)
  set(user "${root}/src/map/map_folder.cpp")
  set(page "${root}/src/map/page")
  quoin_embed(${target} map_page FILES "${page}/index.html" "${page}/map.css" "${page}/map.js" USERS "${user}")
  find_file(QUOIN_LEAFLET_SCRIPT leaflet.min.js PATHS /usr/share/javascript/leaflet NO_DEFAULT_PATH)
  find_file(QUOIN_LEAFLET_STYLE leaflet.css PATHS /usr/share/javascript/leaflet NO_DEFAULT_PATH)
  if(NOT QUOIN_LEAFLET_SCRIPT OR NOT QUOIN_LEAFLET_STYLE)
    message(STATUS "Maps will have no page: Leaflet (Debian: libjs-leaflet) not found")
    # Empty ones: definitions of this target must equal those of quoin_core.
    set(QUOIN_LEAFLET_SCRIPT "${CMAKE_CURRENT_BINARY_DIR}/leaflet.min.js")
    set(QUOIN_LEAFLET_STYLE "${CMAKE_CURRENT_BINARY_DIR}/leaflet.css")
    file(TOUCH "${QUOIN_LEAFLET_SCRIPT}" "${QUOIN_LEAFLET_STYLE}")
  endif()
  quoin_embed(${target} map_page FILES "${QUOIN_LEAFLET_SCRIPT}" "${QUOIN_LEAFLET_STYLE}" USERS "${user}")
endfunction()
