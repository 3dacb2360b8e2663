# The target `docs`: a reference of the public headers by doxygen (docs/reference.doxyfile) and the documents as a site
# by mkdocs (docs/site.yml), each where its program is there. Below docs/ of the build folder: reference/, site/.
find_program(DOXYGEN_PROGRAM doxygen)
find_program(MKDOCS_PROGRAM mkdocs)
mark_as_advanced(DOXYGEN_PROGRAM MKDOCS_PROGRAM)
if(NOT DOXYGEN_PROGRAM AND NOT MKDOCS_PROGRAM)
  return()
endif()
add_custom_target(docs)
