# stagewire_generate(): generate from a spec while a project is built. docs/how-to/build-systems.md explains it.
#
#   stagewire_generate(
#     TARGET name               # a target of this name is added, and built with the others
#     SPEC folder...            # folders that hold protocols
#     OUT folder                # a folder of its own; nothing else may stand in it
#     [TEMPLATES folder]        # templates that stand in for those of stagewire
#     [OPTIONS option...]       # further options of `stagewire generate`, such as --target python
#   )
#
# Relative folders are below the current source folder; OUT is below the current binary folder.
# Afterwards <name>_OUTPUTS holds all files that are generated. STAGEWIRE_COMMAND is the command to run.

cmake_policy(VERSION 3.20)

function(stagewire_generate)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "TARGET;OUT;TEMPLATES" "SPEC;OPTIONS")
  if(DEFINED arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "stagewire_generate: what is ${arg_UNPARSED_ARGUMENTS}?")
  endif()
  foreach(name IN ITEMS TARGET SPEC OUT)
    if("${arg_${name}}" STREQUAL "")
      message(FATAL_ERROR "stagewire_generate: ${name} is missing")
    endif()
  endforeach()
  find_program(STAGEWIRE_COMMAND stagewire REQUIRED)

  get_filename_component(out "${arg_OUT}" ABSOLUTE BASE_DIR "${CMAKE_CURRENT_BINARY_DIR}")
  set(command "${STAGEWIRE_COMMAND}" generate --out "${out}")
  set(watched)
  foreach(spec IN LISTS arg_SPEC)
    get_filename_component(spec "${spec}" ABSOLUTE)
    list(APPEND command --spec "${spec}")
    # What is added or removed later is not among the inputs of today. Examples and captures may stand
    # in the spec, beside it, or, where the spec is a single protocol, beside the folder around it.
    list(APPEND watched "${spec}/*.yaml" "${spec}/../conformance/*.yaml" "${spec}/../../conformance/*.yaml")
  endforeach()
  if(NOT "${arg_TEMPLATES}" STREQUAL "")
    get_filename_component(templates "${arg_TEMPLATES}" ABSOLUTE)
    list(APPEND command --templates "${templates}")
    list(APPEND watched "${templates}/*")
  endif()
  list(APPEND command ${arg_OPTIONS})
  file(GLOB_RECURSE ignored CONFIGURE_DEPENDS ${watched})

  # Any edit can change the names of the outputs, so each one configures the project anew. The inputs come
  # first: they are known of a spec that is wrong, too, and its mending must be noticed.
  _stagewire_list(inputs ${command} --list-inputs)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${inputs})
  _stagewire_list(outputs ${command} --list-outputs)

  # Generated files that did not change keep their time: a stamp tells when the generator ran. It stands
  # outside OUT, which belongs to the generator.
  set(stamp "${CMAKE_CURRENT_BINARY_DIR}/${arg_TARGET}.stamp")
  add_custom_command(
    OUTPUT "${stamp}"
    BYPRODUCTS ${outputs}
    COMMAND ${command}
    COMMAND "${CMAKE_COMMAND}" -E touch "${stamp}"
    DEPENDS ${inputs}
    COMMENT "stagewire generate: ${arg_TARGET}"
    VERBATIM
  )
  add_custom_target("${arg_TARGET}" ALL DEPENDS "${stamp}")
  set("${arg_TARGET}_OUTPUTS" "${outputs}" PARENT_SCOPE)
endfunction()

# Runs a command that lists paths, one a line, and puts them into a list. Diagnostics come as they are.
function(_stagewire_list variable)
  execute_process(
    COMMAND "${CMAKE_COMMAND}" -E env PYTHONUTF8=1 ${ARGN}
    OUTPUT_VARIABLE listed
    RESULT_VARIABLE result
    OUTPUT_STRIP_TRAILING_WHITESPACE
    ENCODING UTF-8
  )
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "stagewire_generate: what is to be generated is wrong; see above")
  endif()
  string(REPLACE ";" "\\;" listed "${listed}")
  string(REGEX REPLACE "\r?\n" ";" listed "${listed}")
  set("${variable}" "${listed}" PARENT_SCOPE)
endfunction()
