// Ctrl-C as a request to finish the current work.
#pragma once

#include <maquette/maquette.hpp>

// From now on Ctrl-C, SIGTERM and SIGHUP ask to stop; the next time they end the program at once.
void catch_interrupts();
bool interrupted();
// The first signal that asked; 0 before.
int interrupting_signal();

// While this lives, a request to stop stops the source: a wait for a frame ends at once.
class StoppedByInterrupt {
 public:
  explicit StoppedByInterrupt(const maquette::Source& source);
  ~StoppedByInterrupt();
  StoppedByInterrupt(const StoppedByInterrupt&) = delete;
  StoppedByInterrupt& operator=(const StoppedByInterrupt&) = delete;

 private:
  maq_source* source_;
};
