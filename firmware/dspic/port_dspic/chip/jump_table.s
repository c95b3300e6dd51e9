; The application's first rows: a goto per vector, reset first, then traps and interrupts in the order of the vector table in
; page 0, whose entries point here, four address units apart. What is not served resets.
        .macro  unserved count
        .rept   \count
        goto    __unserved
        .endr
        .endm

        .section .jump_table, code, address(0x2080)
        .global __jump_table
__jump_table:
        goto    __resetPRI
        unserved 1                  ; traps
        goto    __OscillatorFail
        goto    __AddressError
        goto    __StackError
        goto    __MathError
        goto    __DMACError
        unserved 2
        unserved 7                  ; interrupts 0 to 6
        goto    __T2Interrupt       ; 7
        unserved 1
        goto    __SPI1ErrInterrupt  ; 9
        goto    __SPI1Interrupt     ; 10
        unserved 3
        goto    __DMA1Interrupt     ; 14
        unserved 5
        goto    __INT1Interrupt     ; 20
        unserved 8
        goto    __INT2Interrupt     ; 29
        unserved 2
        goto    __SPI2ErrInterrupt  ; 32
        unserved 85                 ; to 117
