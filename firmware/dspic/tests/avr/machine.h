/* What the tests need of an ATmega1284P: a way to speak, a way to stop. */
#ifndef MACHINE_H
#define MACHINE_H

/* stdout goes to the serial port from now on. */
void machine_start(void);

/* Ends the simulation: asleep with interrupts off. */
void machine_stop(void);

#endif
