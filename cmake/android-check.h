// Declarations that libc++ expects of Android's headers and musl's do not have (cmake/android-check.cmake).
#pragma once

#include <locale.h>
#include <stdlib.h>

#ifdef __cplusplus
extern "C" {
#endif
long long strtoll_l(const char*, char**, int, locale_t);
unsigned long long strtoull_l(const char*, char**, int, locale_t);
#ifdef __cplusplus
}
#endif
