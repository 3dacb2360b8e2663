# The target `docs`: a reference of the public headers by doxygen (docs/reference.doxyfile) and the documents as a site
# by mkdocs (docs/site.yml), each where its program is there. Below docs/ of the build folder: reference/, site/.
find_program(DOXYGEN_PROGRAM doxygen)
find_program(MKDOCS_PROGRAM mkdocs)
mark_as_advanced(DOXYGEN_PROGRAM MKDOCS_PROGRAM)
if(NOT DOXYGEN_PROGRAM AND NOT MKDOCS_PROGRAM)
  return()
endif()
add_custom_target(docs)
set(docs_dir ${PROJECT_BINARY_DIR}/docs)
file(MAKE_DIRECTORY ${docs_dir})
if(DOXYGEN_PROGRAM)
  file(READ ${PROJECT_SOURCE_DIR}/docs/reference.doxyfile text)
  list(TRANSFORM SEXTANT_PUBLIC_HEADERS PREPEND ${PROJECT_BINARY_DIR}/headers/ OUTPUT_VARIABLE headers)
  list(JOIN headers " " headers)
  file(WRITE ${docs_dir}/doxyfile "${text}
INPUT = ${headers}
STRIP_FROM_PATH = ${PROJECT_BINARY_DIR}/headers
OUTPUT_DIRECTORY = ${docs_dir}/reference
")
  file(MAKE_DIRECTORY ${docs_dir}/reference)
  add_custom_command(TARGET docs COMMAND ${DOXYGEN_PROGRAM} ${docs_dir}/doxyfile
    COMMENT "API reference: ${docs_dir}/reference/index.html" VERBATIM)
endif()
if(MKDOCS_PROGRAM)
  file(READ ${PROJECT_SOURCE_DIR}/docs/site.yml text)
  file(WRITE ${docs_dir}/site.yml "${text}docs_dir: ${PROJECT_SOURCE_DIR}/docs\nsite_dir: ${docs_dir}/site\n")
  add_custom_command(TARGET docs COMMAND ${MKDOCS_PROGRAM} build --quiet --clean --config-file ${docs_dir}/site.yml
    COMMENT "Site: ${docs_dir}/site/index.html" VERBATIM)
endif()
