#include "interrupt.h"

#include <csignal>
#include <initializer_list>

namespace {

volatile std::sig_atomic_t stop_asked = 0;

}  // namespace

void catch_interrupts() {
  for (const int number : {SIGINT, SIGTERM}) {
    std::signal(number, [](int caught) {
      stop_asked = 1;
      std::signal(caught, SIG_DFL);
    });
  }
}

bool interrupted() { return stop_asked != 0; }
