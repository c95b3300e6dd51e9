/* SPI2 as the bridge's slave: 16-bit words, the first preloaded by hand, the others by DMA. */
#include "board/link.h"

#include "port.h"
#include "sfr.h"

/* Offsets in the DMA RAM, bytes. */
#define OUT_OFFSET 0u
#define IN_OFFSET 32u

/* CKP 0, CKE 0: mode 1. The slave has no FIFO: between two words of the bridge the DMA loads the next one, which is
 * right whether the module keeps a preloaded word in its buffer or in its shift register. */
#define LINK_CON1 (SPICON1_MODE16 | SPICON1_SSEN)
#define OUT_CON (DMACON_FROM_RAM | DMACON_MODE_ONE_SHOT)
#define IN_CON DMACON_MODE_ONE_SHOT

#define DMA_REG(reg, channel) ((uint16_t)((reg) + (channel)*DMA_STRIDE))
#define OUT_CHANNEL 0u
#define IN_CHANNEL 1u

static void link_spi_set_channel(struct board *board, uint16_t channel, uint16_t offset, uint16_t words)
{
    sfr_write(board, DMA_REG(DMA0REQ, channel), IRQ_SPI2);
    sfr_write(board, DMA_REG(DMA0STA, channel), offset);
    sfr_write(board, DMA_REG(DMA0PAD, channel), SPI2BUF);
    sfr_write(board, DMA_REG(DMA0CNT, channel), (uint16_t)(words - 1u));
}

void link_start(struct board *board)
{
    sfr_write(board, SPI2STAT, 0);
    sfr_write(board, SPI2CON1, LINK_CON1);
    link_spi_set_channel(board, OUT_CHANNEL, OUT_OFFSET, LINK_WORDS - 1u); /* the first word goes by hand */
    link_spi_set_channel(board, IN_CHANNEL, IN_OFFSET, LINK_WORDS);
}

#define SETTLE_READS 8u

/* Some of the family ignore a write that follows too soon. SPITBF does not tell that from a slave that has taken the
 * word into its shift register: the module begins anew, so that the word cannot be there twice, and has more time. */
static void link_spi_preload(struct board *board, uint16_t word)
{
    sfr_write(board, SPI2STAT, SPISTAT_SPIEN);
    sfr_write(board, SPI2BUF, word);
    if (sfr_read(board, SPI2STAT) & SPISTAT_SPITBF)
        return;
    sfr_write(board, SPI2STAT, 0);
    sfr_write(board, SPI2STAT, SPISTAT_SPIEN);
    for (uint8_t i = 0; i < SETTLE_READS; i++)
        (void)sfr_read(board, SPI2STAT);
    sfr_write(board, SPI2BUF, word);
}

/* Module and DMA begin anew: whatever was clocked too much or too little is over. */
static void link_spi_arm(struct board *board, const uint16_t *words, uint16_t to_receive)
{
    volatile uint16_t *out = DMA_WORDS_AT(board, OUT_OFFSET);
    sfr_write(board, DMA_REG(DMA0CON, OUT_CHANNEL), OUT_CON);
    sfr_write(board, DMA_REG(DMA0CON, IN_CHANNEL), IN_CON);
    sfr_write(board, SPI2STAT, 0); /* bits, words, overflow */
    for (uint16_t i = 1; i < LINK_WORDS; i++)
        out[i - 1u] = words[i];
    sfr_clear(board, IRQ_WORD(IFS0, IRQ_DMA1), IRQ_BIT(IRQ_DMA1));
    sfr_write(board, DMA_REG(DMA0CNT, IN_CHANNEL), (uint16_t)(to_receive - 1u));
    sfr_write(board, DMA_REG(DMA0CON, IN_CHANNEL), IN_CON | DMACON_CHEN);
    sfr_write(board, DMA_REG(DMA0CON, OUT_CHANNEL), OUT_CON | DMACON_CHEN);
    link_spi_preload(board, words[0]);
    board->link_words = to_receive;
}

void board_link_arm(struct board *board, const uint16_t *words)
{
    link_spi_arm(board, words, LINK_WORDS);
}

void board_link_arm_service(struct board *board, const uint16_t *words)
{
    link_spi_arm(board, words, SERVICE_WORDS);
}

void port_on_dma1(struct board *board)
{
    uint16_t words[SERVICE_WORDS];
    const uint16_t count = board->link_words;
    const volatile uint16_t *in = DMA_WORDS_AT(board, IN_OFFSET);
    sfr_clear(board, IRQ_WORD(IFS0, IRQ_DMA1), IRQ_BIT(IRQ_DMA1));
    for (uint16_t i = 0; i < count; i++)
        words[i] = in[i];
    if (count == SERVICE_WORDS)
        node_on_service(&board->node, words);
    else
        node_on_order(&board->node, words);
}

/* Select rose. At a quick SCK it does so before the DMA has moved the order's last word; by now it has, and the order
 * comes first. After a transfer cut short, slave and DMA stand somewhere within the record: they begin anew. */
void port_on_int2(struct board *board)
{
    sfr_clear(board, IRQ_WORD(IFS0, IRQ_INT2), IRQ_BIT(IRQ_INT2));
    if (sfr_read(board, IRQ_WORD(IFS0, IRQ_DMA1)) & IRQ_BIT(IRQ_DMA1))
        port_on_dma1(board);
    node_on_transfer_end(&board->node);
}

/* More words came than were asked for: arming sets it right at the next chance. */
void port_on_spi2_error(struct board *board)
{
    sfr_clear(board, IRQ_WORD(IFS0, IRQ_SPI2_ERROR), IRQ_BIT(IRQ_SPI2_ERROR));
    sfr_clear(board, SPI2STAT, SPISTAT_SPIROV);
    node_on_link_overflow(&board->node);
}
