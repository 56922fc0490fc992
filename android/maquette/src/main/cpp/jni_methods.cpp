// The native methods of dev.maquette.jni.Native: functions of the C API, each called with the arguments that Java
// gives. A number stays a number. A handle, a function or a `void*` is an address, a Long of Java. Any other pointer is
// a dev.maquette.jni.Memory or null. If the last parameter takes a new handle, the method returns the handle.
#include <cstddef>
#include <cstring>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "jni_call.h"

namespace maq_jni {
namespace {

jfieldID address_in_memory = nullptr;

template <typename Type, typename = void>
struct IsComplete : std::false_type {};
template <typename Type>
struct IsComplete<Type, std::void_t<decltype(sizeof(Type))>> : std::true_type {};

// A struct that only the library knows.
template <typename Type>
constexpr bool kIsOpaque = std::is_class_v<Type> && !IsComplete<Type>::value;

enum class Kind { kNumber, kAddress, kMemory, kNewHandle };

template <typename Type>
constexpr Kind kind_of() {
  using Pointed = std::remove_pointer_t<Type>;
  if constexpr (!std::is_pointer_v<Type>) {
    return Kind::kNumber;
  } else if constexpr (std::is_function_v<Pointed> || std::is_void_v<Pointed>) {
    return std::is_const_v<Pointed> ? Kind::kMemory : Kind::kAddress;
  } else if constexpr (kIsOpaque<std::remove_const_t<Pointed>>) {
    return Kind::kAddress;
  } else if constexpr (std::is_pointer_v<Pointed> && kIsOpaque<std::remove_pointer_t<Pointed>>) {
    return Kind::kNewHandle;
  } else {
    return Kind::kMemory;
  }
}

// The type of a parameter or a result in Java; enums have 4 bytes.
template <typename Type>
using Java = std::conditional_t<
    std::is_void_v<Type> || std::is_same_v<Type, maq_status>, void,
    std::conditional_t<
        std::is_floating_point_v<Type>, Type,
        std::conditional_t<
            std::is_pointer_v<Type>, std::conditional_t<kind_of<Type>() == Kind::kMemory, jobject, jlong>,
            std::conditional_t<sizeof(std::conditional_t<std::is_void_v<Type>, char, Type>) == 8, jlong, jint>>>>;

template <typename Type>
constexpr const char* name_of() {
  if constexpr (std::is_void_v<Type>) return "V";
  if constexpr (std::is_same_v<Type, jint>) return "I";
  if constexpr (std::is_same_v<Type, jlong>) return "J";
  if constexpr (std::is_same_v<Type, jfloat>) return "F";
  if constexpr (std::is_same_v<Type, jdouble>) return "D";
  if constexpr (std::is_same_v<Type, jobject>) return "Ldev/maquette/jni/Memory;";
}

template <typename Type>
Type argument(JNIEnv* env, Java<Type> value) {
  if constexpr (kind_of<Type>() == Kind::kNumber) {
    return Type(value);
  } else if constexpr (kind_of<Type>() == Kind::kAddress) {
    return reinterpret_cast<Type>(value);
  } else {
    return value == nullptr ? nullptr : static_cast<Type>(address_in(env, value));
  }
}

template <auto function, typename Parameters, typename Indices>
struct Method;

template <auto function, typename... Parameters, size_t... index>
struct Method<function, std::tuple<Parameters...>, std::index_sequence<index...>> {
  using Result = decltype(function(std::declval<Parameters>()...));
  static constexpr bool kIsMaker = sizeof...(index) < sizeof...(Parameters);
  using JavaResult =
      std::conditional_t<kIsMaker, jlong, Java<std::conditional_t<std::is_pointer_v<Result>, jlong, Result>>>;
  template <size_t i>
  using Parameter = std::tuple_element_t<i, std::tuple<Parameters...>>;

  static JavaResult JNICALL run(JNIEnv* env, jclass, Java<Parameter<index>>... values) {
    return call(env, [&]() -> JavaResult {
      if constexpr (kIsMaker) {
        std::remove_pointer_t<Parameter<sizeof...(index)>> made = nullptr;
        check(function(argument<Parameter<index>>(env, values)..., &made));
        return address_of(made);
      } else if constexpr (std::is_same_v<Result, maq_status>) {
        check(function(argument<Parameter<index>>(env, values)...));
      } else if constexpr (std::is_pointer_v<Result>) {
        return address_of(function(argument<Parameter<index>>(env, values)...));
      } else {
        return JavaResult(function(argument<Parameter<index>>(env, values)...));
      }
    });
  }

  static std::string signature() {
    return "(" + (std::string() + ... + name_of<Java<Parameter<index>>>()) + ")" + name_of<JavaResult>();
  }
};

struct NamedMethod {
  std::string name, signature;
  void* function;
};

template <auto function, typename Result, typename... Parameters>
NamedMethod method(const char* name, Result (*)(Parameters...)) {
  constexpr bool is_maker = ((kind_of<Parameters>() == Kind::kNewHandle) || ...);
  using Bound = Method<function, std::tuple<Parameters...>, std::make_index_sequence<sizeof...(Parameters) - is_maker>>;
  return {name, Bound::signature(), reinterpret_cast<void*>(Bound::run)};
}

// False: a Java exception is pending.
bool register_methods(JNIEnv* env) {
#define METHOD(function) method<function>(#function, function),
  std::vector<NamedMethod> methods = {
#include "methods.inc"
  };
#undef METHOD
  jclass memory = env->FindClass("dev/maquette/jni/Memory");
  if (memory == nullptr) return false;
  address_in_memory = env->GetFieldID(memory, "address", "J");
  jclass native = env->FindClass("dev/maquette/jni/Native");
  if (address_in_memory == nullptr || native == nullptr) return false;
  std::vector<JNINativeMethod> table;
  for (NamedMethod& one : methods) table.push_back({one.name.data(), one.signature.data(), one.function});
  return env->RegisterNatives(native, table.data(), jint(table.size())) == JNI_OK;
}

// Java writes structs by their layout.
#define AT(field, offset) &&offsetof(Type, field) == offset
#define LAYOUT(struct, size, fields)                                \
  template <typename Type>                                          \
  constexpr bool has_layout_##struct = sizeof(Type) == size fields; \
  static_assert(has_layout_##struct<struct>, #struct " has another layout: run scripts/android/native.py");
#include "methods.inc"
#undef LAYOUT
#undef AT

}  // namespace

void* address_in(JNIEnv* env, jobject memory) { return object<void>(env->GetLongField(memory, address_in_memory)); }

}  // namespace maq_jni

extern "C" JNIEXPORT jint JNICALL JNI_OnLoad(JavaVM* machine, void*) {
  JNIEnv* env = nullptr;
  if (machine->GetEnv(reinterpret_cast<void**>(&env), JNI_VERSION_1_6) != JNI_OK) return JNI_ERR;
  return maq_jni::call(env, [&]() -> jint {
    maq_jni::find_callbacks(env, machine);
    return !env->ExceptionCheck() && maq_jni::register_methods(env) ? JNI_VERSION_1_6 : JNI_ERR;
  });
}

// The memory of a direct buffer.
MAQ_NATIVE(Addresses, jlong, of)(JNIEnv* env, jclass, jobject buffer) {
  return maq_jni::call(env, [&] {
    void* const data = buffer == nullptr ? nullptr : env->GetDirectBufferAddress(buffer);
    if (data == nullptr) maq_jni::refuse("The buffer is not direct: make it with ByteBuffer.allocateDirect.");
    return maq_jni::address_of(data);
  });
}

// A direct buffer over memory of the library.
MAQ_NATIVE(Addresses, jobject, bytesAt)(JNIEnv* env, jclass, jlong address, jlong size_bytes) {
  return env->NewDirectByteBuffer(maq_jni::object<void>(address), size_bytes);
}

// The UTF-8 text at an address, as bytes: JNI's own strings are not quite UTF-8. NULL is an empty text.
MAQ_NATIVE(Addresses, jbyteArray, textAt)(JNIEnv* env, jclass, jlong address) {
  const auto* const text = maq_jni::object<const jbyte>(address);
  const auto size = text == nullptr ? 0 : jsize(std::strlen(reinterpret_cast<const char*>(text)));
  jbyteArray bytes = env->NewByteArray(size);
  if (bytes != nullptr) env->SetByteArrayRegion(bytes, 0, size, text);
  return bytes;
}
