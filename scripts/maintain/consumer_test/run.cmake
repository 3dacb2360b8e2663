# Installs BUILD_DIR into a temporary prefix, builds the consumer project and the example of an estimator in
# process against it, and runs them.
# cmake -DBUILD_DIR=... -DSOURCE_DIR=... -DEXAMPLE_DIR=... -DWORK_DIR=... -DBUILD_TYPE=... -P run.cmake
file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})
function(run what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${what} failed (${result}):\n${output}")
  endif()
  message(STATUS "${what}: ok")
endfunction()
function(build_project name source)
  run("configure ${name}" ${CMAKE_COMMAND} -G Ninja -S ${source} -B ${WORK_DIR}/${name}
    -DCMAKE_PREFIX_PATH=${WORK_DIR}/prefix -DCMAKE_BUILD_TYPE=${BUILD_TYPE}
    -DCMAKE_FIND_PACKAGE_NO_PACKAGE_REGISTRY=ON)
  run("build ${name}" ${CMAKE_COMMAND} --build ${WORK_DIR}/${name})
endfunction()
run("install" ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${WORK_DIR}/prefix)
build_project(consumer ${SOURCE_DIR})
run("run" ${WORK_DIR}/consumer/consumer)
build_project(example ${EXAMPLE_DIR})
run("run example" ${WORK_DIR}/example/my_sextant run synthetic:s18@0-2 --estimator least_squares
  --set estimator.iterations=5 --out ${WORK_DIR}/results)
file(STRINGS ${WORK_DIR}/results/records.jsonl estimated REGEX "least_squares.*\"ego\",\"status\":\"ok\"")
list(LENGTH estimated n)
if(NOT n EQUAL 2)
  message(FATAL_ERROR "expected 2 estimated camera motions, got ${n}")
endif()
if(EXISTS ${WORK_DIR}/prefix/bin/sextant)
  run("installed program" ${WORK_DIR}/prefix/bin/sextant --help)
endif()
file(REMOVE_RECURSE ${WORK_DIR})
