# Verilator decides how many files it writes; one file that includes them all gives the build a name to depend on, and
# the compiler the whole model at once.
file(GLOB parts ${DIRECTORY}/*.cpp)
list(SORT parts)
set(text "")
foreach(part ${parts})
    get_filename_component(name ${part} NAME)
    string(APPEND text "#include \"${name}\"\n")
endforeach()
file(WRITE ${OUTPUT} "${text}")
