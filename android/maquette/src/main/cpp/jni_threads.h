// Threads of the library, which Java does not know: what they tell Java.
#pragma once

#include <memory>

#include "jni_call.h"

namespace maq_jni {

// Makes this thread known to Java for as long as the object lives, as one that Java's end does not wait for. `env` is
// NULL when the virtual machine ends, and all its objects with it.
class Attached {
 public:
  Attached();
  ~Attached();
  Attached(const Attached&) = delete;
  Attached& operator=(const Attached&) = delete;

  JNIEnv* env = nullptr;

 private:
  bool detach_ = false;
};

// A dev.maquette.Changes that a thread of the library tells of changes of state.
class Listener {
 public:
  Listener(JNIEnv* env, jobject changes);
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  // Any thread. What Java throws is dropped: no Java code waits to catch it.
  void tell(jint state, jint status, const char* text) const noexcept;

  void release(JNIEnv* env);

 private:
  jobject changes_;
  jmethodID on_change_;
};

// An object of the C API and whom it tells of changes: what Java has as a handle.
template <typename Object>
class Listened {
 public:
  // `create` returns a status; it gets the user data for the object's callback, which calls tell(), and where to write
  // the object.
  template <typename Create>
  static jlong create(JNIEnv* env, jobject changes, const Create& create) {
    std::unique_ptr<Listened> made(new Listened(env, changes));
    const maq_status status = create(made.get(), &made->object_);
    if (status != MAQ_OK) made->listener_.release(env);
    check(status);
    return handle(made.release());
  }

  static void destroy(JNIEnv* env, jlong listened, void (*destroy)(Object*)) {
    const std::unique_ptr<Listened> taken(maq_jni::object<Listened>(listened));
    destroy(taken->object_);  // from now on it tells nothing
    taken->listener_.release(env);
  }

  static Object* of(jlong listened) { return maq_jni::object<Listened>(listened)->object_; }

  static void tell(void* listened, jint state, jint status, const char* text) noexcept {
    static_cast<Listened*>(listened)->listener_.tell(state, status, text);
  }

 private:
  Listened(JNIEnv* env, jobject changes) : listener_(env, changes) {}

  Listener listener_;
  Object* object_ = nullptr;
};

}  // namespace maq_jni
