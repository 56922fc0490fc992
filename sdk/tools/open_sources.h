// The sources that a request to stop ends.
#pragma once

#include <maquette/maquette.hpp>

// Ends the waits of all sources of which a StoppedByInterrupt lives. From any thread; not from a signal handler.
void stop_open_sources();
