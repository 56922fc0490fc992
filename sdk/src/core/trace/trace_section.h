// Sections in Android's traces (Perfetto, systrace): the work of the library's threads, stage by stage.
#pragma once

namespace maq {

// Shown from its making to its end, on the thread that makes it; sections may lie in each other. While no trace is
// recorded it costs two calls; elsewhere than on Android nothing is opened, and nothing happens.
class TraceSection {
 public:
  explicit TraceSection(const char* name) : is_open_(begin(name)) {}
  ~TraceSection() { end(); }
  TraceSection(const TraceSection&) = delete;
  TraceSection& operator=(const TraceSection&) = delete;

  // Ends the section and begins another.
  void next(const char* name) {
    end();
    is_open_ = begin(name);
  }

 private:
  static bool begin(const char* name);
  void end();

  bool is_open_;  // a trace may begin or end meanwhile
};

}  // namespace maq
