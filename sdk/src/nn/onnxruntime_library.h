// ONNX Runtime, opened privately at run time so that an app with its own copy does not clash.
#pragma once

#include <memory>
#include <string>

#include "core/log.h"

// Types of onnxruntime_c_api.h, which builds without ONNX Runtime do not have.
struct OrtApi;
struct OrtEnv;
struct OrtRunOptions;
struct OrtStatus;

namespace maq {

// A text of ONNX Runtime without the place in its source, the function and the line end that some begin and end with.
std::string without_source_place(const char* text);

class OnnxRuntimeLibrary {
 public:
  // Opens `explicit_path`, or searches as maq_context_create documents when it is empty.
  // Throws MAQ_ERROR_RUNTIME_LIBRARY.
  OnnxRuntimeLibrary(const std::string& explicit_path, const Log& log);
  ~OnnxRuntimeLibrary();
  OnnxRuntimeLibrary(const OnnxRuntimeLibrary&) = delete;
  OnnxRuntimeLibrary& operator=(const OnnxRuntimeLibrary&) = delete;

  const OrtApi& api() const { return *api_; }
  OrtEnv* env() const { return env_; }
  const Log& log() const { return log_; }
  const std::string& version() const { return version_; }
  int minor_version() const { return minor_version_; }  // 26 of 1.26.0
  const std::string& path() const { return path_; }

  // A function that only some builds export, or null.
  void* symbol(const char* name) const;

  // Throws `status` with "<what>: <ONNX Runtime's text>" when `result` is an error, and frees it. The status is
  // MAQ_ERROR_OUT_OF_MEMORY instead where the text says so.
  void check(OrtStatus* result, maq_status status, const std::string& what) const;

 private:
  void start();

  Log log_;
  void* library_ = nullptr;
  const OrtApi* api_ = nullptr;
  OrtEnv* env_ = nullptr;
  std::string version_;
  int minor_version_ = 0;
  std::string path_;
};

}  // namespace maq
