#include "machine.h"

#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <thread>

namespace {

// The text after "key" and a colon in a file of such lines; "" if there is none.
std::string value_of(const char* path, const std::string& key) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    const size_t colon = line.find(':');
    if (colon == std::string::npos || line.compare(0, key.size(), key) != 0) continue;
    if (line.find_first_not_of(" \t", key.size()) != colon) continue;
    const size_t start = line.find_first_not_of(" \t", colon + 1);
    return start == std::string::npos ? "" : line.substr(start);
  }
  return "";
}

nlohmann::ordered_json text_or_null(const std::string& text) {
  return text.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(text);
}

std::string first_line(const char* path) {
  std::string line;
  std::getline(std::ifstream(path) >> std::ws, line);
  return line;
}

int64_t kibibytes(const std::string& text) { return text.empty() ? 0 : std::stoll(text); }

double seconds_of(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

}  // namespace

nlohmann::ordered_json describe_machine() {
  std::string processor = value_of("/proc/cpuinfo", "model name");
  if (processor.empty()) processor = value_of("/proc/cpuinfo", "Model");  // ARM
  utsname system{};
  uname(&system);

  const std::string x86_flags = value_of("/proc/cpuinfo", "flags");
  std::istringstream flags(x86_flags.empty() ? value_of("/proc/cpuinfo", "Features") : x86_flags);
  const std::set<std::string> telling = {"sse4_1",      "avx2",     "fma",     "avx512f", "avx_vnni", "avx512_vnni",
                                         "avx512_bf16", "amx_int8", "asimddp", "i8mm",    "sve"};
  nlohmann::ordered_json isa = nlohmann::ordered_json::array();
  for (std::string flag; flags >> flag;) {
    if (telling.count(flag) != 0) isa.push_back(flag);
  }
  double load = 0;
  const bool knows_load = getloadavg(&load, 1) == 1;
  return {{"processor", text_or_null(processor)},
          {"architecture", system.machine},
          {"cores", std::thread::hardware_concurrency()},
          {"instruction_sets", isa},
          {"memory_mib", kibibytes(value_of("/proc/meminfo", "MemTotal")) / 1024},
          {"system", std::string(system.sysname) + " " + system.release},
          {"governor", text_or_null(first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"))},
          {"load", knows_load ? nlohmann::ordered_json(load) : nlohmann::ordered_json()}};
}

nlohmann::ordered_json describe_build(const maquette::Context& context) {
  return {{"sdk", maq_get_sdk_version()},
          {"commit", maq_get_git_commit()},
          {"options", maq_get_build_options()},
          {"onnxruntime", context.onnxruntime_version()}};
}

double own_processor_seconds() { return seconds_of(CLOCK_PROCESS_CPUTIME_ID); }

double others_processor_seconds() {
  std::istringstream all(first_line("/proc/stat"));
  std::string name;
  double user = 0, nice = 0, system = 0, idle = 0, waiting = 0, interrupts = 0, soft_interrupts = 0, stolen = 0;
  all >> name >> user >> nice >> system >> idle >> waiting >> interrupts >> soft_interrupts >> stolen;
  const double ticks = user + nice + system + interrupts + soft_interrupts + stolen;
  return ticks / double(sysconf(_SC_CLK_TCK)) - own_processor_seconds();
}

int64_t peak_memory_bytes() { return 1024 * kibibytes(value_of("/proc/self/status", "VmHWM")); }

double seconds_since_boot() { return seconds_of(CLOCK_BOOTTIME); }

double seconds_since_start() {
  if (const char* started_s = std::getenv(kStartVariable)) return seconds_since_boot() - std::atof(started_s);
  std::ifstream file("/proc/self/stat");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  // The program's name may hold spaces and stands in parentheses; the start time is the 20th field after it.
  std::istringstream fields(text.substr(text.rfind(')') + 1));
  std::string field;
  for (int i = 0; i < 20; ++i) fields >> field;
  const double started_s = field.empty() ? 0 : std::stod(field) / double(sysconf(_SC_CLK_TCK));
  return seconds_since_boot() - started_s;
}
