// A libonnxruntime.so whose XNNPACK and NNAPI can be had: sessions run as the real library's do on the CPU, while this
// one says which nodes a provider took. What it exports is found by dlsym().
#pragma once

#ifdef __cplusplus
extern "C" {
#endif

// Answers of providers from now on, and the requests since.
typedef struct FakeProviders {
  int taken_nodes, other_nodes;  // of each graph
  int fails;                     // 1: sessions with a provider cannot be made
  int appended;                  // how many times a provider was
  char name[16];                 // the latest
  char threads[16];              // that it shall have
  int session_threads;           // of the latest session
  char spins[4];                 // whether its threads do: "0" or "1"
} FakeProviders;

typedef FakeProviders* (*FakeProvidersFunction)(void);  // "fake_providers"

#ifdef __cplusplus
}
#endif
