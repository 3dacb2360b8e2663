# The package for Python: on where pybind11, Python's headers and numpy are.
# Debian's packages are for its own Python, whatever else comes first in the PATH; another one: -DPython3_EXECUTABLE=...
if(NOT Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python3_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "Python")
endif()
find_package(Python3 COMPONENTS Interpreter Development.Module NumPy QUIET)
if(Python3_FOUND)
  find_package(pybind11 2.9 QUIET)
endif()
set(found OFF)
# A sanitized module cannot be loaded into a Python that is not.
if(NOT SEXTANT_SANITIZE AND pybind11_FOUND AND Python3_Development.Module_FOUND AND Python3_NumPy_FOUND)
  set(found ON)
endif()
if(SEXTANT_PYTHON MATCHES "/")  # of a build folder in which it was the name of a program
  unset(SEXTANT_PYTHON CACHE)
endif()
option(SEXTANT_PYTHON "Build the Python package" ${found})
if(SEXTANT_PYTHON AND NOT found)
  message(FATAL_ERROR "SEXTANT_PYTHON: pybind11, Python's headers or numpy are missing: run scripts/setup --python")
endif()
if(NOT SEXTANT_PYTHON)
  message(STATUS "Python package: off (scripts/setup --python installs what it needs)")
  return()
endif()
# Where this Python looks for packages of the system, below the prefix: lib/python3/dist-packages on Debian.
execute_process(
  COMMAND ${Python3_EXECUTABLE} -c "import sysconfig
s = 'deb_system' if 'deb_system' in sysconfig.get_scheme_names() else sysconfig.get_default_scheme()
print(sysconfig.get_path('platlib', s, vars={'base': '', 'platbase': '', 'installed_base': '', 'installed_platbase': ''}).lstrip('/'))"
  OUTPUT_VARIABLE site OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
set(SEXTANT_PYTHON_SITE ${site} CACHE STRING "Folder for the Python package, below the prefix")
