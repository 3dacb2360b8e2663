# The package for Python. SEXTANT_PYTHON is AUTO (build it where pybind11, Python's headers and numpy are installed), ON
# (an error where one of them is missing) or OFF. AUTO is decided by every configuring again, so that the package appears
# in an existing build folder after `scripts/setup --python`.
# Debian's packages are for its own Python, whatever else comes first in the PATH; another one: -DPython3_EXECUTABLE=...
if(NOT Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python3_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "Python")
endif()
find_package(Python3 COMPONENTS Interpreter Development.Module NumPy QUIET)
if(Python3_FOUND)
  find_package(pybind11 2.9 QUIET)
endif()
set(found OFF)
# A Python without sanitizers cannot load a sanitized module.
if(NOT SEXTANT_SANITIZE AND pybind11_FOUND AND Python3_Development.Module_FOUND AND Python3_NumPy_FOUND)
  set(found ON)
endif()
set(SEXTANT_PYTHON AUTO CACHE STRING "Build the Python package: AUTO, ON or OFF")
set_property(CACHE SEXTANT_PYTHON PROPERTY STRINGS AUTO ON OFF)
if(SEXTANT_PYTHON STREQUAL "AUTO")
  set(SEXTANT_WITH_PYTHON ${found})
elseif(SEXTANT_PYTHON AND NOT found)
  message(FATAL_ERROR "SEXTANT_PYTHON=${SEXTANT_PYTHON}: pybind11, Python's headers or numpy are missing: run scripts/setup --python")
else()
  set(SEXTANT_WITH_PYTHON ${SEXTANT_PYTHON})
endif()
if(NOT SEXTANT_WITH_PYTHON)
  message(STATUS "Python package: not built (SEXTANT_PYTHON=${SEXTANT_PYTHON}; scripts/setup --python installs what it needs)")
  return()
endif()
message(STATUS "Python package: built into ${PROJECT_BINARY_DIR}/python")
# Where this Python looks for packages of the system, below the prefix: lib/python3/dist-packages on Debian.
execute_process(
  COMMAND ${Python3_EXECUTABLE} -c "import sysconfig
s = 'deb_system' if 'deb_system' in sysconfig.get_scheme_names() else sysconfig.get_default_scheme()
print(sysconfig.get_path('platlib', s, vars={'base': '', 'platbase': '', 'installed_base': '', 'installed_platbase': ''}).lstrip('/'))"
  OUTPUT_VARIABLE site OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
set(SEXTANT_PYTHON_SITE ${site} CACHE STRING "Folder for the Python package, below the prefix")
