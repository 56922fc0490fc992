// The machine of a measurement, and its load meanwhile (Linux: /proc).
#pragma once

#include <cstdint>
#include <maquette/maquette.hpp>
#include <nlohmann/json.hpp>

// Processor, cores, instruction sets that matter to networks, memory, system, frequency governor and load. Values that
// the system does not report are null.
nlohmann::ordered_json describe_machine();

// Version, commit and options of the SDK, and the version of ONNX Runtime.
nlohmann::ordered_json describe_build(const maquette::Context& context);

// Seconds that processors worked for this process, all threads, since it started.
double own_processor_seconds();

// Seconds that processors worked for other processes, or that the host of a virtual machine kept, since the system
// started; resolution .01 s.
double others_processor_seconds();

// The most memory that this process has held so far ("peak RSS"); 0 if the system does not say.
int64_t peak_memory_bytes();

// Seconds since the system started, and since this process started (loading of libraries included, resolution 0.01 s).
// A program that starts another one in its place passes the time of that start in the environment variable.
inline constexpr const char* kStartVariable = "MAQ_PROGRAM_STARTED_S";
double seconds_since_boot();
double seconds_since_start();
