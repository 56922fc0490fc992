#pragma once

#include <string>

__attribute__((visibility("default"))) void fake_trace_record(bool records);
// The names of the sections that began since the last call, a line each, with a dot for each that they lie in.
__attribute__((visibility("default"))) std::string fake_trace_sections();
