; The vector table in page 0, which is the loader's and never erased: every entry leads into the application's jump table.
; The loader itself is served through the alternate table, which the linker fills.
        .section .application_vectors, code, address(0x000004)
        .set    entry, 0x2084
        .rept   126
        .pword  entry
        .set    entry, entry + 4
        .endr
