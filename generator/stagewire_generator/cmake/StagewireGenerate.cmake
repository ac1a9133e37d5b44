# stagewire_generate(): generate code from a spec as part of a build. See docs/how-to/build-systems.md.
#
#   stagewire_generate(
#     TARGET name               # the name of the new target, which is part of the default build
#     SPEC directory...         # directories that contain protocols
#     OUT directory             # an output directory for generated files only
#     [TEMPLATES directory]     # templates that replace built-in ones
#     [OPTIONS option...]       # more options of `stagewire generate`, such as --target python
#   )
#
# Paths are relative to the current source directory; OUT is relative to the current binary directory.
# <name>_OUTPUTS is set to the list of generated files. STAGEWIRE_COMMAND is the command to run.

cmake_policy(VERSION 3.20)

function(stagewire_generate)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "TARGET;OUT;TEMPLATES" "SPEC;OPTIONS")
  if(DEFINED arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "stagewire_generate: unknown arguments: ${arg_UNPARSED_ARGUMENTS}")
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
    # The list of inputs does not include files that are added later. Examples and captures may be in the
    # spec, next to it, or, if the spec is a single protocol, next to its parent directory.
    list(APPEND watched "${spec}/*.yaml" "${spec}/../conformance/*.yaml" "${spec}/../../conformance/*.yaml")
  endforeach()
  if(NOT "${arg_TEMPLATES}" STREQUAL "")
    get_filename_component(templates "${arg_TEMPLATES}" ABSOLUTE)
    list(APPEND command --templates "${templates}")
    list(APPEND watched "${templates}/*")
  endif()
  list(APPEND command ${arg_OPTIONS})
  file(GLOB_RECURSE ignored CONFIGURE_DEPENDS ${watched})

  # Any edit can change the names of the outputs, so every edit configures the project again. List the
  # inputs first: they are also known for an invalid spec, and fixing it must trigger a build.
  _stagewire_list(inputs ${command} --list-inputs)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${inputs})
  _stagewire_list(outputs ${command} --list-outputs)

  # Unchanged generated files keep their modification time, so a stamp records when the generator ran. It is
  # outside OUT, which is for generated files only.
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

# Run a command that prints one path per line, and return the paths as a list. Diagnostics are passed through.
function(_stagewire_list variable)
  execute_process(
    COMMAND "${CMAKE_COMMAND}" -E env PYTHONUTF8=1 ${ARGN}
    OUTPUT_VARIABLE listed
    RESULT_VARIABLE result
    OUTPUT_STRIP_TRAILING_WHITESPACE
    ENCODING UTF-8
  )
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "stagewire_generate: the command failed; see the messages above")
  endif()
  string(REPLACE ";" "\\;" listed "${listed}")
  string(REGEX REPLACE "\r?\n" ";" listed "${listed}")
  set("${variable}" "${listed}" PARENT_SCOPE)
endfunction()
