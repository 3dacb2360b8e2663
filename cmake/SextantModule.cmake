# sextant_module(NAME [HOT] [DEPENDS module|target ...] [PRIVATE target ...] [TEST_DEPENDS target ...])
#
# Makes the library sextant_NAME (alias Sextant::NAME) from the *.cc files of the
# current folder, and the test program NAME_test from its *_test.cc files. ctest
# names are NAME/Suite.Case. Headers are included as "sextant/<folder>/file.h",
# where lib/ is dropped: lib/geometry/se3.h is "sextant/geometry/se3.h". HOT: a module whose loops
# over points, pixels or records take the time of a run (sextant_optimise).
function(sextant_module NAME)
  cmake_parse_arguments(ARG "HOT" "" "DEPENDS;PRIVATE;TEST_DEPENDS" ${ARGN})
  set(kind plain)
  if(ARG_HOT)
    set(kind hot)
  endif()
  file(GLOB headers CONFIGURE_DEPENDS *.h)
  file(GLOB sources CONFIGURE_DEPENDS *.cc)
  file(GLOB tests CONFIGURE_DEPENDS *_test.cc)
  list(FILTER sources EXCLUDE REGEX "(_test|main)\\.cc$")
  list(FILTER headers EXCLUDE REGEX "testing\\.h$")  # test helpers are linked, not installed

  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  string(REGEX REPLACE "^lib/" "" folder ${folder})
  get_filename_component(parent ${PROJECT_BINARY_DIR}/include/sextant/${folder} DIRECTORY)
  file(MAKE_DIRECTORY ${parent})
  sextant_link_headers(${folder})

  set(target sextant_${NAME})
  if(sources)
    set(scope PUBLIC)
    sextant_unite(compiled ${NAME} ${sources})
    add_library(${target} STATIC ${compiled} ${headers})
  else()
    set(scope INTERFACE)
    add_library(${target} INTERFACE ${headers})
  endif()
  add_library(Sextant::${NAME} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${NAME})
  target_include_directories(${target} ${scope}
    $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${target} ${scope} sextant_flags ${ARG_DEPENDS})
  if(sources)
    sextant_optimise(${target} ${kind})
    sextant_precompile(${target} ${kind})
  endif()
  if(ARG_PRIVATE AND sources)  # a header-only module has nothing to link
    target_link_libraries(${target} PRIVATE ${ARG_PRIVATE})
  endif()
  set_property(GLOBAL APPEND PROPERTY SEXTANT_MODULES ${target})
  sextant_label_threads(${target} "${sources}" ${ARG_DEPENDS})
  install(FILES ${headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sextant/${folder} COMPONENT dev)

  if(SEXTANT_TESTS AND tests)
    sextant_unite(compiled ${NAME}_test ${tests})
    add_executable(${NAME}_test ${compiled})
    sextant_label_threads(${NAME}_test "${tests}" ${target} ${ARG_TEST_DEPENDS})
    get_target_property(label ${NAME}_test SEXTANT_LABEL)
    target_link_libraries(${NAME}_test PRIVATE ${target} sextant_test_main ${ARG_TEST_DEPENDS})
    sextant_optimise(${NAME}_test test)
    sextant_precompile(${NAME}_test test)
    set_target_properties(${NAME}_test PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/test)
    include(GoogleTest)
    gtest_discover_tests(${NAME}_test TEST_PREFIX ${NAME}/ NO_PRETTY_VALUES DISCOVERY_TIMEOUT 600
      PROPERTIES TIMEOUT ${SEXTANT_TEST_TIMEOUT_S} LABELS "${label}")
  endif()
endfunction()

# sextant_script_test(NAME word...): a test that is a script or another program, in a folder of its own (scripts/maintain/own_folder).
function(sextant_script_test NAME)
  add_test(NAME ${NAME} COMMAND ${PROJECT_SOURCE_DIR}/scripts/maintain/own_folder ${ARGN})
  set_tests_properties(${NAME} PROPERTIES TIMEOUT ${SEXTANT_TEST_TIMEOUT_S})
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

# The folder as seen by #include: a tree of links in the build folder, one link a header, so that
# folders may lie inside one another (datasets/ and datasets/codec/).
function(sextant_link_headers folder)
  set(view ${PROJECT_BINARY_DIR}/include/sextant/${folder})
  file(MAKE_DIRECTORY ${view})
  file(GLOB headers CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.h)
  foreach(header ${headers})
    get_filename_component(name ${header} NAME)
    file(CREATE_LINK ${header} ${view}/${name} SYMBOLIC)
  endforeach()
endfunction()

# Tests that reach a thread of ours are labelled `threads`: where a source, or a module below, calls parallel_for
# or starts a thread. These run under the thread sanitizer (cmake --preset tsan).
function(sextant_label_threads target sources)
  set(label "")
  foreach(source ${sources})
    file(STRINGS ${source} starts REGEX "^ +parallel_for\\(|std::(thread|async)[( ]" LIMIT_COUNT 1)
    if(starts)
      set(label threads)
    endif()
  endforeach()
  foreach(module ${ARGN})
    if(TARGET ${module})
      get_target_property(below ${module} SEXTANT_LABEL)
      if(below)
        set(label threads)
      endif()
    endif()
  endforeach()
  set_target_properties(${target} PROPERTIES SEXTANT_LABEL "${label}")
endfunction()
