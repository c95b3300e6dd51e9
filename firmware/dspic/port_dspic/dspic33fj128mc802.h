/* Registers and bits of the dsPIC33FJ128MC802 that the firmware uses.
 *
 * Addresses: the part's own header and linker script (confidence A). Bits: A, or C (recalled from the data sheet) where
 * marked. RAM is not mapped here but for the 2 KB that DMA reaches. */
#ifndef DSPIC33FJ128MC802_H
#define DSPIC33FJ128MC802_H

#define DSPIC_SFR_END 0x0800u     /* special function registers lie below */
#define DSPIC_DMA_RAM 0x4000u     /* DMAxSTA counts from here */
#define DSPIC_DMA_RAM_WORDS 1024u /* to 0x47FF */

/* Core */
#define TBLPAG 0x0032u
#define SR 0x0042u
#define SR_IPL_SHIFT 5u /* 3 bits: only interrupts of a higher priority are taken */

/* Interrupts: flag and enable of number n in IFS/IEC[n / 16] bit n % 16, priority in IPC[n / 4] bits 4 * (n % 4) */
#define INTCON1 0x0080u
#define INTCON1_OSCFAIL 0x0002u
#define INTCON1_STKERR 0x0004u
#define INTCON1_ADDRERR 0x0008u
#define INTCON1_MATHERR 0x0010u
#define INTCON1_DMACERR 0x0020u
#define INTCON1_NSTDIS 0x8000u /* interrupts do not nest */
#define INTCON2 0x0082u
#define INTCON2_ALTIVT 0x8000u /* the alternate vector table, from 0x000104 */
#define INTCON2_INT1EP 0x0002u /* 1: INT1 on the falling edge */
#define INTCON2_INT2EP 0x0004u
#define IFS0 0x0084u
#define IEC0 0x0094u
#define IPC0 0x00A4u
#define IRQ_T1 3u
#define IRQ_DMA0 4u
#define IRQ_T2 7u
#define IRQ_T3 8u
#define IRQ_SPI1_ERROR 9u
#define IRQ_SPI1 10u
#define IRQ_DMA1 14u
#define IRQ_INT1 20u
#define IRQ_DMA2 24u
#define IRQ_INT2 29u
#define IRQ_SPI2_ERROR 32u
#define IRQ_SPI2 33u
#define IRQ_COUNT 118u

/* Timers: T2 and T3 lie apart from T1 */
#define TMR1 0x0100u
#define PR1 0x0102u
#define T1CON 0x0104u
#define TMR2 0x0106u
#define TMR3 0x010Au
#define PR2 0x010Cu
#define PR3 0x010Eu
#define T2CON 0x0110u
#define T3CON 0x0112u
#define TCON_TCKPS_SHIFT 4u /* 2 bits: 1, 8, 64, 256 cycles a count */
#define TCON_TON 0x8000u

/* SPI: SPI2 lies SPI2_OFFSET above SPI1 */
#define SPI1STAT 0x0240u
#define SPI1CON1 0x0242u
#define SPI1CON2 0x0244u
#define SPI1BUF 0x0248u
#define SPI2STAT 0x0260u
#define SPI2CON1 0x0262u
#define SPI2CON2 0x0264u
#define SPI2BUF 0x0268u
#define SPISTAT_SPIRBF 0x0001u
#define SPISTAT_SPITBF 0x0002u
#define SPISTAT_SPIROV 0x0040u
#define SPISTAT_SPIEN 0x8000u
#define SPICON1_PPRE_SHIFT 0u /* 3: 1:1, 2: 4:1, 1: 16:1, 0: 64:1 (C) */
#define SPICON1_SPRE_SHIFT 2u /* 7: 1:1 ... 0: 8:1 (C) */
#define SPICON1_MSTEN 0x0020u
#define SPICON1_CKP 0x0040u
#define SPICON1_SSEN 0x0080u
#define SPICON1_CKE 0x0100u
#define SPICON1_SMP 0x0200u
#define SPICON1_MODE16 0x0400u
#define SPICON1_DISSDO 0x0800u
#define SPICON1_DISSCK 0x1000u

/* Ports: pins RB0 to RB15 are RP0 to RP15 */
#define TRISB 0x02C8u
#define PORTB 0x02CAu
#define LATB 0x02CCu
#define ODCB 0x02CEu
#define AD1PCFGL 0x032Cu /* 1: the pin is digital; they start as analogue inputs */

/* DMA: channel n at DMA0CON + n * DMA_STRIDE */
#define DMA0CON 0x0380u
#define DMA0REQ 0x0382u
#define DMA0STA 0x0384u
#define DMA0STB 0x0386u
#define DMA0PAD 0x0388u
#define DMA0CNT 0x038Au
#define DMA_STRIDE 12u
#define DMA_CHANNELS 8u
#define DMACS0                                                                                                         \
    0x03E0u /* bits 7..0: write collision in RAM of channel n (XWCOL); 15..8: in the peripheral (PWCOL) (C) */
#define DMACS0_PERIPHERAL_SHIFT 8u
#define DMACS1 0x03E2u /* bits 7..0: ping-pong, the next block is B; 11..8: last active channel */
#define DMACON_MODE_ONE_SHOT 0x0001u
#define DMACON_MODE_PING_PONG 0x0002u
#define DMACON_FROM_RAM 0x2000u /* DIR: RAM to peripheral */
#define DMACON_BYTE 0x4000u     /* SIZE */
#define DMACON_CHEN 0x8000u
#define DMAREQ_FORCE 0x8000u

/* Pin select. Input field: RP number, 31 ties to ground; output field: function code */
#define RPINR0 0x0680u  /* [12:8] INT1 */
#define RPINR1 0x0682u  /* [4:0] INT2 (C) */
#define RPINR20 0x06A8u /* [4:0] SDI1, [12:8] SCK1 */
#define RPINR22 0x06ACu /* [4:0] SDI2, [12:8] SCK2 */
#define RPINR23 0x06AEu /* [4:0] SS2 */
#define RPOR0 0x06C0u   /* RPORn: pins 2n [4:0] and 2n + 1 [12:8] */
#define RP_GROUND 31u
#define RP_PORT 0u
#define RP_SDO1 7u
#define RP_SCK1 8u
#define RP_SDO2 10u

/* System */
#define RCON 0x0740u
#define RCON_POR 0x0001u /* (C), and all of RCON */
#define RCON_BOR 0x0002u
#define RCON_IDLE 0x0004u
#define RCON_SLEEP 0x0008u
#define RCON_WDTO 0x0010u
#define RCON_SWDTEN 0x0020u
#define RCON_SWR 0x0040u
#define RCON_EXTR 0x0080u
#define RCON_IOPUWR 0x4000u
#define RCON_TRAPR 0x8000u
#define OSCCON 0x0742u
#define OSCCON_OSWEN 0x0001u
#define OSCCON_LOCK 0x0020u
#define OSCCON_IOLOCK 0x0040u
#define OSCCON_NOSC_SHIFT 8u
#define OSCCON_COSC_SHIFT 12u
#define OSC_FRC 0u
#define OSC_FRC_PLL 1u
#define OSCCON_HIGH_KEY1 0x78u /* written to the byte at OSCCON + 1, then KEY2, then the value */
#define OSCCON_HIGH_KEY2 0x9Au
#define OSCCON_LOW_KEY1 0x46u /* to the byte at OSCCON */
#define OSCCON_LOW_KEY2 0x57u
#define CLKDIV 0x0744u /* PLLPRE [4:0]: N1 - 2; PLLPOST [7:6]: 0, 1, 3: N2 2, 4, 8 */
#define CLKDIV_PLLPOST_SHIFT 6u
#define PLLFBD 0x0746u /* M - 2 */
#define OSCTUN 0x0748u
#define FRC_HZ 7370000u /* +-2 % from -40 to 85 degrees C, +-5 % to 125 */
#define FCY_MAX_HZ 40000000u

/* Flash */
#define NVMCON 0x0760u
#define NVMKEY 0x0766u
#define NVMCON_WR 0x8000u
#define NVMCON_WREN 0x4000u
#define NVMCON_WRERR 0x2000u
#define NVMCON_ERASE_PAGE 0x4042u /* (C) WREN included, likewise below */
#define NVMCON_WRITE_ROW 0x4001u
#define NVMCON_WRITE_WORD 0x4003u
#define NVMKEY_1 0x55u
#define NVMKEY_2 0xAAu
#define DEVID_PAGE 0x00FFu /* TBLPAG; 0xFF0000: the device id, 0x0629 (B) */
#define DEVID_OFFSET 0x0000u
#define CONFIG_PAGE 0x00F8u          /* configuration words from 0xF80000, of 8 bits each */
#define FUID0_OFFSET 0x0010u         /* FUID0 to FUID3 */
#define FLASH_WORDS 44032u           /* of 24 bits; each takes two addresses: 0x000000 to 0x0157FE */
#define FLASH_ROW_WORDS 64u          /* write unit */
#define FLASH_PAGE_WORDS 512u        /* erase unit */
#define FLASH_PAGE_ERASE_FRC 168517u /* cycles of FRC (C): 22.9 ms, 24.1 at its slowest */
#define FLASH_ROW_WRITE_FRC 11064u
#define FLASH_WORD_WRITE_FRC 355u

#endif
