// Contexts, errors and ownership of handles, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_CONTEXT_HPP_
#define MAQUETTE_CONTEXT_HPP_

#include <memory>
#include <stdexcept>
#include <string>

#include "maquette/context.h"
#include "maquette/types.h"

namespace maquette {

class Error : public std::runtime_error {
 public:
  Error(maq_status status, const char* text) : std::runtime_error(text), status_(status) {}
  maq_status status() const noexcept { return status_; }

 private:
  maq_status status_;
};

// Throws the error of this thread's latest call unless `status` is MAQ_OK.
inline void check(maq_status status) {
  if (status != MAQ_OK) throw Error(status, maq_last_error(nullptr));
}

template <class Handle, void (*destroy)(Handle*)>
struct HandleDeleter {
  void operator()(Handle* handle) const noexcept {
    if (whole == nullptr) destroy(handle);
  }
  std::shared_ptr<const void> whole;  // the object that the handle is a part of, which stays alive; nullptr: none
};
template <class Handle, void (*destroy)(Handle*)>
using Owner = std::unique_ptr<Handle, HandleDeleter<Handle, destroy>>;

// A handle inside another object, which lives at least as long.
template <class Handle>
struct PartOf {
  const Handle* handle;
  std::shared_ptr<const void> whole;
};

inline maq_context_config default_context_config() {
  maq_context_config config;
  check(maq_context_config_init(&config, sizeof config));
  return config;
}

class Context {
 public:
  Context() : Context(default_context_config()) {}
  explicit Context(const maq_context_config& config) {
    maq_context* made = nullptr;
    check(maq_context_create(MAQ_HEADER_VERSION, &config, &made));
    owner_.reset(made);
  }

  maq_context* get() const { return owner_.get(); }

  std::string onnxruntime_version() const {
    const char* version = "";
    check(maq_context_get_onnxruntime(get(), &version, nullptr));
    return version;
  }
  std::string onnxruntime_path() const {
    const char* path = "";
    check(maq_context_get_onnxruntime(get(), nullptr, &path));
    return path;
  }

 private:
  Owner<maq_context, maq_context_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_CONTEXT_HPP_
