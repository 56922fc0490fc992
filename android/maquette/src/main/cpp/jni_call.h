// What every native method shares: statuses of the C API as Java exceptions, and values that cross the border.
#pragma once

#include <jni.h>

#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <type_traits>
#include <vector>

#include "maquette/maquette.h"
#include "status_error.h"

// A native method of an object of the package dev.maquette.jni.
#define MAQ_NATIVE_OF(object, type, name) extern "C" JNIEXPORT type JNICALL Java_dev_maquette_jni_##object##_##name
#define MAQ_NATIVE(type, name) MAQ_NATIVE_OF(Native, type, name)

namespace maq_jni {

// A Java exception is pending already.
struct PendingException {};

inline void check_pending(JNIEnv* env) {
  if (env->ExceptionCheck()) throw PendingException();
}

// Throws dev.maquette.MaquetteException. The message crosses as bytes: JNI's own strings are not quite UTF-8, and may
// end the process where a path is not.
inline void throw_status(JNIEnv* env, maq_status status, const std::string& message) {
  jclass type = env->FindClass("dev/maquette/MaquetteException");
  if (type == nullptr) return;  // what FindClass threw is pending
  jmethodID constructor = env->GetMethodID(type, "<init>", "(I[B)V");
  if (constructor == nullptr) return;
  jbyteArray bytes = env->NewByteArray(jsize(message.size()));
  if (bytes == nullptr) return;
  env->SetByteArrayRegion(bytes, 0, jsize(message.size()), reinterpret_cast<const jbyte*>(message.data()));
  jobject error = env->NewObject(type, constructor, jint(status), bytes);
  if (error != nullptr) env->Throw(jthrowable(error));
}

// Runs the body of a native method; what it throws becomes a Java exception, and the value 0.
template <typename Body>
auto call(JNIEnv* env, Body body) -> decltype(body()) {
  try {
    return body();
  } catch (const PendingException&) {
  } catch (const StatusError& error) {
    throw_status(env, error.status, error.message);
  } catch (const std::bad_alloc&) {
    throw_status(env, MAQ_ERROR_OUT_OF_MEMORY, "There is not enough memory for this call.");
  } catch (const std::exception& error) {
    throw_status(env, MAQ_ERROR_INTERNAL, error.what());
  }
  if constexpr (!std::is_void_v<decltype(body())>) return {};
}

// Handles of the C API cross as numbers; 0 is NULL.
template <typename Object>
Object* object(jlong handle) {
  return reinterpret_cast<Object*>(handle);
}
template <typename Object>
jlong handle(Object* object) {
  return reinterpret_cast<jlong>(object);
}

// UTF-8 of a byte array; "" of null.
inline std::string text(JNIEnv* env, jbyteArray utf8) {
  if (utf8 == nullptr) return {};
  std::string value(size_t(env->GetArrayLength(utf8)), '\0');
  env->GetByteArrayRegion(utf8, 0, jsize(value.size()), reinterpret_cast<jbyte*>(value.data()));
  if (value.find('\0') != std::string::npos) refuse("A text must not contain the character 0.");
  return value;
}

// UTF-8 as a byte array.
inline jbyteArray bytes_of(JNIEnv* env, const char* utf8) {
  const auto size = jsize(std::strlen(utf8));
  jbyteArray bytes = env->NewByteArray(size);
  check_pending(env);
  env->SetByteArrayRegion(bytes, 0, size, reinterpret_cast<const jbyte*>(utf8));
  return bytes;
}

inline jobjectArray texts_of(JNIEnv* env, const std::vector<const char*>& values) {
  jclass type = env->FindClass("[B");
  check_pending(env);
  jobjectArray texts = env->NewObjectArray(jsize(values.size()), type, nullptr);
  check_pending(env);
  for (size_t i = 0; i < values.size(); ++i) {
    jbyteArray bytes = bytes_of(env, values[i]);
    env->SetObjectArrayElement(texts, jsize(i), bytes);
    env->DeleteLocalRef(bytes);
  }
  return texts;
}

inline jdoubleArray doubles_of(JNIEnv* env, const std::vector<jdouble>& values) {
  jdoubleArray array = env->NewDoubleArray(jsize(values.size()));
  check_pending(env);
  env->SetDoubleArrayRegion(array, 0, jsize(values.size()), values.data());
  return array;
}

inline jfloatArray floats_of(JNIEnv* env, const jfloat* values, size_t count) {
  jfloatArray array = env->NewFloatArray(jsize(count));
  check_pending(env);
  env->SetFloatArrayRegion(array, 0, jsize(count), values);
  return array;
}

// The points of a body surface; null where the networks have none.
inline jfloatArray points_of(JNIEnv* env, maq_status status, const maq_densepose_surface& surface) {
  if (status == MAQ_ERROR_UNSUPPORTED) return nullptr;
  check(status);
  return floats_of(env, surface.points_m, size_t(24 * 3) * size_t(surface.nodes) * size_t(surface.nodes));
}

// The `count` numbers of a configuration, in the order of its struct.
inline std::vector<jdouble> numbers(JNIEnv* env, jdoubleArray array, size_t count) {
  if (array == nullptr || size_t(env->GetArrayLength(array)) != count) {
    throw StatusError{MAQ_ERROR_INTERNAL, "a configuration has another number of values"};
  }
  std::vector<jdouble> values(count);
  env->GetDoubleArrayRegion(array, 0, jsize(count), values.data());
  return values;
}

// A struct of the C API that a call fills.
template <typename Struct>
Struct sized() {
  Struct value{};
  value.struct_size = sizeof value;
  return value;
}

struct Memory {
  uint8_t* data = nullptr;
  size_t size_bytes = 0;
};

// The memory of a direct java.nio.ByteBuffer, from its start to its capacity.
inline Memory memory_of(JNIEnv* env, jobject buffer) {
  void* const data = buffer == nullptr ? nullptr : env->GetDirectBufferAddress(buffer);
  if (data == nullptr) refuse("The buffer is not direct: make it with ByteBuffer.allocateDirect.");
  return {static_cast<uint8_t*>(data), size_t(env->GetDirectBufferCapacity(buffer))};
}

}  // namespace maq_jni
