#include "core/json/json_value.h"

#include <nlohmann/json.hpp>

namespace maq {

// Builds a document from the parser's events.
class JsonBuilder : public nlohmann::json_sax<nlohmann::json> {
 public:
  bool null() override { return add(std::monostate()); }
  bool boolean(bool value) override { return add(value); }
  bool number_integer(int64_t value) override { return add(value); }
  bool number_unsigned(uint64_t value) override { return add(value); }
  bool number_float(double value, const std::string&) override { return add(value); }
  bool string(std::string& value) override { return add(std::make_unique<std::string>(std::move(value))); }
  bool binary(nlohmann::json::binary_t&) override { return false; }  // JSON text has none
  bool key(std::string& key) override {
    member_ = &(*std::get<std::unique_ptr<JsonValue::Object>>(open_.back()->value_))[std::move(key)];
    return true;
  }
  bool start_object(size_t) override { return open(std::make_unique<JsonValue::Object>()); }
  bool start_array(size_t) override { return open(std::make_unique<JsonValue::List>()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool parse_error(size_t, const std::string&, const nlohmann::json::exception& error) override {
    const std::string what = error.what();  // "[json.exception.parse_error.101] parse error at line 3, column 9: …"
    error_ = what.substr(what.find(']') + 2);
    return false;
  }

  JsonValue take() { return std::move(root_); }
  const std::string& error() const { return error_; }

 private:
  static constexpr size_t kMaxDepth = 100;

  JsonValue& slot() {
    if (open_.empty()) return root_;
    if (const auto* list = std::get_if<std::unique_ptr<JsonValue::List>>(&open_.back()->value_)) {
      return (*list)->emplace_back();
    }
    return *member_;
  }
  template <class T>
  bool add(T value) {
    slot().value_ = std::move(value);
    return true;
  }
  template <class T>
  bool open(T container) {
    if (open_.size() == kMaxDepth) {
      error_ = "it is nested more than " + std::to_string(kMaxDepth) + " levels deep";
      return false;
    }
    JsonValue& made = slot();
    made.value_ = std::move(container);
    open_.push_back(&made);  // stays where it is: a list grows only while nothing in it is open
    return true;
  }
  bool close() {
    open_.pop_back();
    return true;
  }

  JsonValue root_;
  std::vector<JsonValue*> open_;
  JsonValue* member_ = nullptr;  // the latest key's
  std::string error_;
};

JsonValue JsonValue::parse(const std::string& text) {
  JsonBuilder builder;
  if (!nlohmann::json::sax_parse(text, &builder)) throw JsonError(builder.error());
  return builder.take();
}

std::optional<double> JsonValue::number() const {
  if (const auto* value = std::get_if<double>(&value_)) return *value;
  if (const auto* value = std::get_if<uint64_t>(&value_)) return double(*value);
  if (const auto* value = std::get_if<int64_t>(&value_)) return double(*value);
  return {};
}

const JsonValue* JsonValue::find(const std::string& key) const {
  const Object* const members = object();
  if (members == nullptr) return nullptr;
  const auto found = members->find(key);
  return found == members->end() ? nullptr : &found->second;
}

}  // namespace maq
