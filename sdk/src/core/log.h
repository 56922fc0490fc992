// The log hook of a context. The library itself never prints.
#pragma once

#include <string>

#include "core/error.h"
#include "maquette/context.h"

namespace maq {

class Log {
 public:
  Log() = default;
  Log(maq_log_level level, maq_log_callback callback, void* user_data)
      : level_(level), callback_(callback), user_data_(user_data) {}

  bool wants(maq_log_level level) const { return callback_ != nullptr && level <= level_; }

  // A callback that throws loses its line: logging fails no call, and ends no thread.
  template <class... Parts>
  void write(maq_log_level level, const Parts&... parts) const noexcept {
    if (!wants(level)) return;
    try {
      callback_(user_data_, level, concatenate(parts...).c_str());
    } catch (...) {
    }
  }

 private:
  maq_log_level level_ = MAQ_LOG_OFF;
  maq_log_callback callback_ = nullptr;
  void* user_data_ = nullptr;
};

}  // namespace maq
