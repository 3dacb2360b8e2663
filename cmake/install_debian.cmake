# Run by `cmake --install`: what Debian wants beside every package: copyright and changelog.
# In: package, version, maintainer, source, work, data_dir.
cmake_policy(VERSION 3.22)
set(doc_dir "${CMAKE_INSTALL_PREFIX}/${data_dir}/doc/${package}")
set(work ${work}/${package})
file(MAKE_DIRECTORY ${work})
file(WRITE ${work}/copyright "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: Sextant
Upstream-Contact: ${maintainer}
Source: the repository that this was built from; `sextant --version` names the commit

Files: *
Copyright: 2026 the authors of Sextant
License: Apache-2.0

License: Apache-2.0
 On Debian systems the text of the license is in /usr/share/common-licenses/Apache-2.0.
")

# The section of this version: "## 0.1.0 (2026-11-22)", then lines "- ..." that may go on.
file(READ ${source}/CHANGELOG.md log)
string(REGEX MATCH "\n## ${version} \\(([0-9-]+)\\)\n" head "${log}")
if(NOT head)
  message(FATAL_ERROR "CHANGELOG.md: expected a section '## ${version} (YYYY-MM-DD)'")
endif()
execute_process(COMMAND date -u -R -d ${CMAKE_MATCH_1} OUTPUT_VARIABLE day OUTPUT_STRIP_TRAILING_WHITESPACE
  COMMAND_ERROR_IS_FATAL ANY)
string(FIND "${log}" "${head}" begin)
string(LENGTH "${head}" length)
math(EXPR begin "${begin} + ${length}")
string(SUBSTRING "${log}" ${begin} -1 entry)
string(REGEX REPLACE "\n## .*" "" entry "${entry}")
string(STRIP "${entry}" entry)
string(REGEX REPLACE "\n+" "\n" entry "\n${entry}")
string(REPLACE "\n  " "\n    " entry "${entry}")
string(REPLACE "\n- " "\n  * " entry "${entry}")
file(WRITE ${work}/changelog "sextant (${version}) unstable; urgency=medium\n${entry}\n\n -- ${maintainer}  ${day}\n")
execute_process(COMMAND gzip -9nf ${work}/changelog COMMAND_ERROR_IS_FATAL ANY)
file(INSTALL ${work}/copyright ${work}/changelog.gz DESTINATION "${doc_dir}")
