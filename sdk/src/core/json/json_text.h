// Writes a JSON document from its start to its end.
#pragma once

#include <cstdint>
#include <string>

namespace maq {

class JsonText {
 public:
  // `indent`: spaces a level, each value on a line of its own; -1: all on one line.
  explicit JsonText(int indent = -1) : indent_(indent) {}

  JsonText& begin_object() { return begin('{'); }
  JsonText& end_object() { return end('}'); }
  JsonText& begin_list() { return begin('['); }
  JsonText& end_list() { return end(']'); }
  JsonText& key(const char* name);
  JsonText& value(double number);  // the shortest text that is read as the same number
  JsonText& value(int number) { return add(std::to_string(number)); }
  JsonText& value(int64_t number) { return add(std::to_string(number)); }
  JsonText& value(bool flag) { return add(flag ? "true" : "false"); }
  JsonText& value(const char* text) { return value(std::string(text)); }
  JsonText& value(const std::string& text);  // bytes that are not UTF-8 are replaced
  JsonText& null() { return add("null"); }
  template <class T>
  JsonText& member(const char* name, T given) {
    return key(name).value(given);
  }

  const std::string& text() const { return text_; }

 private:
  JsonText& begin(char bracket);
  JsonText& end(char bracket);
  JsonText& add(const std::string& value);
  void break_line();

  int indent_, depth_ = 0;
  bool is_first_ = true, is_after_key_ = false;
  std::string text_;
};

}  // namespace maq
