/* The built-ins of the chip's compiler, so that any compiler can check the code for the chip. */
#ifndef XC16_STUB_H
#define XC16_STUB_H

#define interrupt unused /* attributes: on other machines they mean something else */
#define auto_psv unused

void __builtin_write_OSCCONH(int value);
void __builtin_write_OSCCONL(int value);
void __builtin_write_NVM(void);
unsigned int __builtin_tblrdl(unsigned int offset);
unsigned int __builtin_tblrdh(unsigned int offset);
void __builtin_tblwtl(unsigned int offset, unsigned int value);
void __builtin_tblwth(unsigned int offset, unsigned int value);

#endif
