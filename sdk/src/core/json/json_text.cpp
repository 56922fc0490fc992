#include "core/json/json_text.h"

#include <nlohmann/json.hpp>

namespace maq {

JsonText& JsonText::key(const char* name) {
  value(std::string(name));
  text_ += indent_ < 0 ? ":" : ": ";
  is_after_key_ = true;
  return *this;
}

JsonText& JsonText::value(double number) { return add(nlohmann::json(number).dump()); }

JsonText& JsonText::value(const std::string& text) {
  return add(nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

JsonText& JsonText::begin(char bracket) {
  add(std::string(1, bracket));
  ++depth_;
  is_first_ = true;
  return *this;
}

JsonText& JsonText::end(char bracket) {
  --depth_;
  if (!is_first_) break_line();
  is_first_ = false;
  text_ += bracket;
  return *this;
}

JsonText& JsonText::add(const std::string& value) {
  if (!is_after_key_) {
    if (!is_first_) text_ += ',';
    if (depth_ > 0) break_line();
  }
  text_ += value;
  is_first_ = is_after_key_ = false;
  return *this;
}

void JsonText::break_line() {
  if (indent_ < 0) return;
  text_ += '\n';
  text_.append(size_t(indent_ * depth_), ' ');
}

}  // namespace maq
