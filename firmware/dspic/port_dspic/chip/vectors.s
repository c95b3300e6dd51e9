; Page 0 is the loader's and never erased: where a reset goes, and both vector tables. Nothing of it is left to the linker: it
; makes both tables or none, and the first must not name this program's functions.

        .section .reset_vector, code, address(0x000000)
        goto    __resetPRI

; The vector table: every entry leads into the application's jump table.
        .section .application_vectors, code, address(0x000004)
        .set    entry, 0x2084
        .rept   126
        .pword  entry
        .set    entry, entry + 4
        .endr

; The alternate table, in the same order as the jump table: the loader's own. What it does not serve resets.
        .macro  unserved count
        .rept   \count
        .pword  paddr(__unserved)
        .endr
        .endm

        .section .loader_vectors, code, address(0x000104)
        unserved 1                          ; traps
        .pword  paddr(__AltOscillatorFail)
        .pword  paddr(__AltAddressError)
        .pword  paddr(__AltStackError)
        .pword  paddr(__AltMathError)
        .pword  paddr(__AltDMACError)
        unserved 2
        unserved 7                          ; interrupts 0 to 6
        .pword  paddr(__AltT2Interrupt)     ; 7
        unserved 1
        .pword  paddr(__AltSPI1ErrInterrupt) ; 9
        .pword  paddr(__AltSPI1Interrupt)   ; 10
        unserved 3
        .pword  paddr(__AltDMA1Interrupt)   ; 14
        unserved 5
        .pword  paddr(__AltINT1Interrupt)   ; 20
        unserved 8
        .pword  paddr(__AltINT2Interrupt)   ; 29
        unserved 2
        .pword  paddr(__AltSPI2ErrInterrupt) ; 32
        unserved 85                         ; to 117
