# sextant_module(NAME [DEPENDS module|target ...] [PRIVATE target ...] [TEST_DEPENDS target ...])
#
# Makes the library sextant_NAME (alias Sextant::NAME) from the *.cc files of the current folder, and the test program
# NAME_test from its *_test.cc files. DEPENDS and PRIVATE name every module that the folder includes, apart from its
# tests; the test layers/includes refuses other includes. ctest names are NAME/Suite.Case.
# Headers that docs/reference.txt does not list as public are installed below sextant/internal.
file(STRINGS ${PROJECT_SOURCE_DIR}/docs/reference.txt SEXTANT_PUBLIC_HEADERS REGEX "^sextant/")
function(sextant_module NAME)
  cmake_parse_arguments(ARG "" "" "DEPENDS;PRIVATE;TEST_DEPENDS" ${ARGN})
  file(GLOB headers CONFIGURE_DEPENDS *.h)
  file(GLOB sources CONFIGURE_DEPENDS *.cc)
  file(GLOB tests CONFIGURE_DEPENDS *_test.cc)
  list(FILTER sources EXCLUDE REGEX "(_test|main)\\.cc$")
  list(FILTER headers EXCLUDE REGEX "testing\\.h$")  # test helpers are linked, not installed

  set(target sextant_${NAME})
  if(sources)
    set(scope PUBLIC)
    add_library(${target} STATIC ${sources} ${headers})
    target_precompile_headers(${target} REUSE_FROM sextant_precompiled)
  else()
    set(scope INTERFACE)
    add_library(${target} INTERFACE ${headers})
  endif()
  add_library(Sextant::${NAME} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${NAME})
  target_link_libraries(${target} ${scope} sextant_flags ${ARG_DEPENDS})
  if(ARG_PRIVATE AND sources)  # a header-only module has nothing to link
    target_link_libraries(${target} PRIVATE ${ARG_PRIVATE})
  endif()
  set_property(GLOBAL APPEND PROPERTY SEXTANT_MODULES ${target})
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  string(REGEX REPLACE "^lib/" "" folder ${folder})
  foreach(header ${headers})
    get_filename_component(name ${header} NAME)
    set(place sextant/${folder}/${name})
    if(NOT place IN_LIST SEXTANT_PUBLIC_HEADERS)
      set(place sextant/internal/${place})
    endif()
    get_filename_component(place ${place} DIRECTORY)
    install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${place} COMPONENT dev)
  endforeach()

  if(SEXTANT_TESTS AND tests)
    add_executable(${NAME}_test ${tests})
    target_link_libraries(${NAME}_test PRIVATE ${target} ${ARG_TEST_DEPENDS})
    sextant_test_program(${NAME})
  endif()
endfunction()

# sextant_test_program(NAME [PROPERTY value ...]): the cases of the program NAME_test become tests of ctest.
function(sextant_test_program NAME)
  target_link_libraries(${NAME}_test PRIVATE sextant_test_main)
  target_precompile_headers(${NAME}_test REUSE_FROM sextant_test_main)
  set_target_properties(${NAME}_test PROPERTIES POSITION_INDEPENDENT_CODE OFF  # as sextant_test_main
    RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/test)
  include(GoogleTest)
  gtest_discover_tests(${NAME}_test TEST_PREFIX ${NAME}/ NO_PRETTY_VALUES DISCOVERY_TIMEOUT 600
    PROPERTIES TIMEOUT ${SEXTANT_TEST_TIMEOUT_S} ${ARGN})
endfunction()

# sextant_script_test(NAME word...): a test that is a script or another program, in a folder of its own (scripts/maintain/own_folder).
# Exit code 77: skipped.
function(sextant_script_test NAME)
  add_test(NAME ${NAME} COMMAND ${PROJECT_SOURCE_DIR}/scripts/maintain/own_folder ${ARGN})
  set_tests_properties(${NAME} PROPERTIES TIMEOUT ${SEXTANT_TEST_TIMEOUT_S} SKIP_RETURN_CODE 77)
endfunction()

# The target `tests`: all that ctest runs, which is all of these folders; without benchmarks.
function(sextant_add_tests_target)
  add_custom_target(tests)
  set(folders ${ARGN})
  while(folders)
    list(POP_FRONT folders folder)
    get_property(targets DIRECTORY ${folder} PROPERTY BUILDSYSTEM_TARGETS)
    get_property(below DIRECTORY ${folder} PROPERTY SUBDIRECTORIES)
    list(APPEND folders ${below})
    if(targets)
      add_dependencies(tests ${targets})
    endif()
  endwhile()
endfunction()
