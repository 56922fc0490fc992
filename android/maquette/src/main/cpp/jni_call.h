// Shared by all native methods: errors of native code become Java exceptions, and addresses are numbers in Java.
#pragma once

#include <jni.h>

#include <exception>
#include <new>
#include <string>
#include <type_traits>

#include "maquette/maquette.h"
#include "status_error.h"

// Defines a native method of an object of the package dev.maquette.jni.
#define MAQ_NATIVE(object, type, name) extern "C" JNIEXPORT type JNICALL Java_dev_maquette_jni_##object##_##name

namespace maq_jni {

// Thrown while a Java exception is pending.
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

// Runs the body of a native method. A C++ exception becomes a Java exception, and the result is 0.
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

// Handles of the C API and other addresses are numbers in Java; 0 is NULL.
template <typename Object>
Object* object(jlong address) {
  return reinterpret_cast<Object*>(address);
}
template <typename Pointer>
jlong address_of(Pointer* pointer) {
  return reinterpret_cast<jlong>(pointer);
}

// The address of a dev.maquette.jni.Memory.
void* address_in(JNIEnv* env, jobject memory);

// Finds the static methods of dev.maquette.jni.Callbacks, when the library is loaded.
void find_callbacks(JNIEnv* env, JavaVM* machine);

}  // namespace maq_jni
