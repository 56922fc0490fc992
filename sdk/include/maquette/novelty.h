/* Novelty: how unexpected each frame of a stream is, and where. */
#ifndef MAQUETTE_NOVELTY_H_
#define MAQUETTE_NOVELTY_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A novelty stream scores each frame by its surprisal in bits: the less likely the frame is after the frames before,
 * the more bits. It finds cuts, frozen or covered cameras, and objects that appear, without a list of events. A network
 * divides the frame into cells and describes each cell by codes, which are entries of a codebook. A second network (or
 * the bigram prior) and the stream's own past say how likely each code is.
 *
 *   maq_novelty_create(context, NULL, &novelty);
 *   score.struct_size = sizeof score;
 *   maq_novelty_push(novelty, frame, &score);   // each frame of the stream
 *   if (score.is_event) { ... } */
typedef struct maq_novelty maq_novelty;

/* The source of code probabilities. Values never change meaning; new ones are added at the end. */
typedef enum maq_novelty_method {
  MAQ_NOVELTY_AUTO = 0,  /* the bundle's transformer, which sees three past frames; without one, the bigram prior */
  MAQ_NOVELTY_BIGRAM = 1 /* the bigram prior: how often a code followed another in training. Takes about 0 ms. */
} maq_novelty_method;

/* Options. 0 is the default in every field; `model` has its own (types.h). */
typedef struct maq_novelty_config {
  uint32_t struct_size;
  maq_model_options model;   /* default bundle: share/maquette/models/prediction-int8, installed with the library */
  maq_novelty_method method; /* default MAQ_NOVELTY_AUTO */
  float event_ratio;         /* a frame is an event from this ratio up, and from 1 / event_ratio down: above 1, at
                                most 1e6; 0 (default): 4 */
  const maq_novelty* shared_with; /* shares the networks of this stream; `model` is then not read. The two streams
                                     encode frames one after the other. AUTO uses the transformer of this stream, if it
                                     has one. Either may be destroyed first. Default NULL: own networks */
} maq_novelty_config;

/* The score of one frame. */
typedef struct maq_novelty_score {
  uint32_t struct_size;
  int32_t columns;         /* of the map */
  int32_t rows;            /* of the map */
  float bits;              /* mean of all codes: about 0.03 when nothing changes, 1 to 3 when much moves, above 8 for a
                              frame that nothing predicted */
  float ratio;             /* bits divided by the median of the 8 frames before, with 0.035 added to both against noise.
                              1 is usual; 1/6 is a stream that freezes. 1 while fewer than 4 frames are known */
  int32_t is_event;        /* 1: a cut, or the ratio reached event_ratio or 1 / event_ratio */
  int32_t is_cut;          /* 1: scene cut: the previous frame does not make this one more likely. Ratios begin anew. */
  int32_t is_stream_start; /* 1: the frame continues no stream: the first one, another size, format or clock, an earlier
                              time, or more than a second later. `bits` then counts how rare the codes are. */
} maq_novelty_score;

/* Wall-clock milliseconds of the latest frame, and counts since the stream was created. */
typedef struct maq_novelty_stats {
  uint32_t struct_size;
  float resize_ms;             /* the frame resized to the encoder's input */
  float network_ms;            /* the encoder */
  float nearest_ms;            /* the nearest codebook entries of its features */
  float transformer_ms;        /* the transformer; 0 with the bigram prior */
  float push_ms;               /* total */
  int32_t threads;             /* of the networks */
  uint64_t pushed_count;       /* frames */
  uint64_t event_count;        /* frames with is_event */
  uint64_t stream_start_count; /* frames with is_stream_start */
} maq_novelty_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_novelty_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_novelty_config_init(maq_novelty_config* config, uint32_t struct_size);

/* Creates a novelty stream: loads a model bundle of the task "prediction" and checks its files' sizes and SHA-256.
 * `config` may be NULL for the defaults. Free `*novelty` with maq_novelty_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED (a
 * bundle of another task), MAQ_ERROR_RUNTIME_LIBRARY. Blocks while files are read and threads are measured. */
MAQ_API maq_status maq_novelty_create(maq_context* context, const maq_novelty_config* config, maq_novelty** novelty);

/* Frees the stream (NULL is fine), and its networks with the last stream that shares them.
 * Once for each handle, from any thread. May block briefly. */
MAQ_API void maq_novelty_destroy(maq_novelty* novelty);

/* Scores the stream's next frame, of any size and format except depth. The frame is not kept. The caller sets
 * score->struct_size. An error leaves the stream as it was before the frame.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (a depth image), MAQ_ERROR_INFERENCE. Blocks
 * while the networks run, also for streams that share them. */
MAQ_API maq_status maq_novelty_push(maq_novelty* novelty, const maq_frame* frame, maq_novelty_score* score);

/* Writes the map of the latest frame: for each cell, the mean bits of its codes. The mean of the map is score.bits.
 * Writes columns * rows floats, row by row from the top left. The cells divide a frame of any shape evenly. `capacity`
 * is the capacity of `bits`, in floats.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (`capacity` is too small; before the first frame). Does not
 * block. */
MAQ_API maq_status maq_novelty_copy_map(const maq_novelty* novelty, float* bits, size_t capacity);

/* Decodes the codes of the latest frame to an image. It shows the detail that the network kept; lost detail cannot
 * raise the score. The image is RGB, 64 x 64 pixels with the SDK's bundle, whatever the frame's shape. Timestamp and
 * sequence are the frame's; maq_frame_get_origin returns MAQ_FRAME_PREDICTED with a horizon of 0. The first call opens
 * another network. `*frame` comes from a pool of 4: give it back with maq_frame_release.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (also before the first frame), MAQ_ERROR_POOL_EMPTY,
 * MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_INFERENCE. Blocks while the network runs. */
MAQ_API maq_status maq_novelty_acquire_reconstruction(maq_novelty* novelty, maq_frame** frame);

/* Forgets the frames so far, to begin another stream.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_novelty_reset(maq_novelty* novelty);

/* Returns times and counts. The caller sets stats->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_novelty_get_stats(const maq_novelty* novelty, maq_novelty_stats* stats);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_NOVELTY_H_ */
