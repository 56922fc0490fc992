// A JSON document in memory. Its destructor does not allocate, so short memory is an exception and nothing worse.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

namespace maq {

// The text says which fault the parser found, and in which line and column.
class JsonError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class JsonValue {
 public:
  using List = std::vector<JsonValue>;
  using Object = std::map<std::string, JsonValue>;

  // Throws JsonError for text that is not JSON, has a number that a double cannot hold, or is over 100 levels deep.
  // Of equal keys the last counts.
  static JsonValue parse(const std::string& text);

  // NULL or no number for a value of another type.
  const List* list() const { return of<List>(); }
  const Object* object() const { return of<Object>(); }
  const std::string* text() const { return of<std::string>(); }
  const bool* flag() const { return std::get_if<bool>(&value_); }
  std::optional<double> number() const;
  // A number without fraction and exponent.
  bool is_whole() const { return std::holds_alternative<uint64_t>(value_) || std::holds_alternative<int64_t>(value_); }
  // A whole number of 0 or more.
  const uint64_t* size() const { return std::get_if<uint64_t>(&value_); }

  // The member of an object; NULL where there is none.
  const JsonValue* find(const std::string& key) const;

 private:
  friend class JsonBuilder;
  template <class T>
  const T* of() const {
    const auto* pointer = std::get_if<std::unique_ptr<T>>(&value_);
    return pointer == nullptr ? nullptr : pointer->get();
  }

  // Pointers keep a value small: a hostile list has millions.
  std::variant<std::monostate, bool, int64_t, uint64_t, double, std::unique_ptr<std::string>, std::unique_ptr<List>,
               std::unique_ptr<Object>>
      value_;
};

}  // namespace maq
