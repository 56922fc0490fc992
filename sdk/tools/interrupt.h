// Ctrl-C as a request to finish what is at hand.
#pragma once

// From now on Ctrl-C (and SIGTERM) asks to stop; a second time it ends the program at once.
void catch_interrupts();
bool interrupted();
