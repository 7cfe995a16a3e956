# Embeds the tables of Quoin's own block pack (src/io/packs/data) in a target: src/io/packs/pack_own.cpp and
# node_pack.cpp include each as a string literal. `root`: the top of the repository. As a script,
# `cmake -DINPUT=FILE -DOUTPUT=FILE -P QuoinBlockPack.cmake` writes one literal.
if(CMAKE_SCRIPT_MODE_FILE)
  file(READ "${INPUT}" text)
  file(WRITE "${OUTPUT}" "R\"quoin(${text})quoin\"\n")
  return()
endif()

set(quoin_block_pack_script "${CMAKE_CURRENT_LIST_FILE}")

function(quoin_embed_block_pack target root)
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/block_pack")
  file(MAKE_DIRECTORY "${folder}")
  set(outputs)
  foreach(table families rules textures node_families node_rules node_tiles)
    set(input "${root}/src/io/packs/data/${table}.json")
    set(output "${folder}/block_pack_${table}.inc")
    add_custom_command(OUTPUT "${output}"
      COMMAND "${CMAKE_COMMAND}" "-DINPUT=${input}" "-DOUTPUT=${output}" -P "${quoin_block_pack_script}"
      DEPENDS "${input}" "${quoin_block_pack_script}" VERBATIM COMMENT "Embedding ${table}.json")
    list(APPEND outputs "${output}")
  endforeach()
  set_source_files_properties("${root}/src/io/packs/pack_own.cpp" "${root}/src/io/packs/node_pack.cpp"
    PROPERTIES OBJECT_DEPENDS "${outputs}")
  target_sources(${target} PRIVATE ${outputs})
  target_include_directories(${target} PRIVATE "${folder}")
endfunction()
