; From reset to main(): stack, constants, nothing else. There is no data to clear or to initialise: all state is in `board`,
; which survives a reset, and main.c sets what it must.
        .equ    SPLIM, 0x0020
        .equ    PSVPAG, 0x0034
        .equ    CORCON, 0x0044

        .section .startup, code
        .global __resetPRI
__resetPRI:
        mov     #__SP_init, w15
        mov     #__SPLIM_init, w0
        mov     w0, SPLIM
        nop                         ; the stack limit holds from the instruction after the next
        mov     #__const_psvpage, w0
        mov     w0, PSVPAG
        bset    CORCON, #2          ; constants are read through their window
        goto    _main               ; does not return

; Where every vector leads that is not served. A jump to the start would not do: the processor would go on at the
; interrupt's priority, and serve none of its own.
        .global __unserved
__unserved:
        reset
