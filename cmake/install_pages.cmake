# Run by `cmake --install`: man pages and completions, which `program` writes, to their places below the prefix.
# In: program, work (a folder to write in), data_dir.
file(REMOVE_RECURSE ${work}/man1)
file(MAKE_DIRECTORY ${work})
execute_process(COMMAND ${program} man --out ${work}/man1 OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(GLOB pages ${work}/man1/*.1)
execute_process(COMMAND gzip -9n ${pages} COMMAND_ERROR_IS_FATAL ANY)
file(GLOB pages ${work}/man1/*.1.gz)
file(INSTALL ${pages} DESTINATION "${CMAKE_INSTALL_PREFIX}/${data_dir}/man/man1")

# A shell looks for the files of packages elsewhere than for those of an administrator.
set(zsh_dir zsh/site-functions)
if(CMAKE_INSTALL_PREFIX MATCHES "/usr$")
  set(zsh_dir zsh/vendor-completions)
endif()
foreach(shell bash zsh fish)
  execute_process(COMMAND ${program} completion ${shell} OUTPUT_FILE ${work}/${shell} COMMAND_ERROR_IS_FATAL ANY)
endforeach()
function(install_as file directory name)
  file(INSTALL ${work}/${file} DESTINATION "${CMAKE_INSTALL_PREFIX}/${data_dir}/${directory}" RENAME ${name})
endfunction()
install_as(bash bash-completion/completions sextant)
install_as(zsh ${zsh_dir} _sextant)
install_as(fish fish/vendor_completions.d sextant.fish)
