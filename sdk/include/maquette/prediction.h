/* Prediction: what a stream will show next, and how surprising what it shows is. */
#ifndef MAQUETTE_PREDICTION_H_
#define MAQUETTE_PREDICTION_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A predictor gets the frames of a stream as they come and makes pictures of what it will show a while later: to hide
 * the time that a picture takes from the camera to the screen, or to bridge a camera that stalls. It sees pictures, not
 * the world: never steer anything by what it made up. maq_frame_get_origin tells its frames from a camera's. */

typedef struct maq_predictor maq_predictor;

/* Values never change meaning; new ones are added at the end. */
typedef enum maq_prediction_method {
  MAQ_PREDICTION_AUTO = 0,   /* the others mixed, place by place, by how right each was there about the frames that have
                                come, at that time ahead; the last frame until that is known, and while nothing moves */
  MAQ_PREDICTION_LAST = 1,   /* the last frame, repeated */
  MAQ_PREDICTION_MOTION = 2, /* everything moves on as it moved between the last two frames */
  MAQ_PREDICTION_NETWORK = 3 /* what AUTO has, changed by what networks foresee, at 64 x 64 pixels, where anything
                               moves. Of a predictor, not of a concealer; not in every bundle */
} maq_prediction_method;

/* Values never change meaning; new ones are added at the end. */
typedef enum maq_network_mode {
  MAQ_NETWORK_AUTO = 0,     /* the first of these that the bundle has */
  MAQ_NETWORK_MENDED = 1,   /* what AUTO has, mended by a network that sees the frames before as well; one pass */
  MAQ_NETWORK_EXPECTED = 2, /* the mean of the codes that may come, in one pass; it blurs what is uncertain */
  MAQ_NETWORK_DRAWN = 3     /* one of what may come, drawn code after code, in steps of at most 0.1 s; takes long */
} maq_network_mode;

typedef struct maq_predictor_config {
  uint32_t struct_size;
  int32_t threads;              /* 1 to 64; 0 (default): the machine's large cores, at most 4 */
  maq_prediction_method method; /* default MAQ_PREDICTION_AUTO */
  uint32_t frame_pool_size;     /* predicted frames the app may hold at once, 1 to 64; default 4 */
  /* Of MAQ_PREDICTION_NETWORK alone: */
  maq_network_mode network_mode; /* default MAQ_NETWORK_AUTO */
  const char* bundle_path; /* as of maq_surprise_config; default NULL, the bundle installed with the library. Copied. */
  const maq_memory_file* bundle_files; /* default NULL. Copied. */
  uint32_t bundle_file_count;          /* default 0 */
  float
      temperature; /* of codes that are drawn: 0 (default) takes the likeliest of each; 1 draws by the probabilities */
  uint32_t top_k;  /* only so many of the likeliest; 0 (default): all */
  uint64_t seed;   /* equal seeds draw equal frames, on one processor; default 0 */
  uint32_t passes; /* of codes that are drawn: 0 (default) draws one after another, exactly by the probabilities; 1 to
                      16 all of a frame at once, at most so many times, each time after those of the time before:
                      quicker, and the same where that settles */
  const maq_predictor* networks_of; /* another predictor with networks, whose networks and mode this one uses as well:
                                       it takes little memory then, and networks of both run one after the other; what
                                       is said of bundle and network_mode is not read. The other may be destroyed first.
                                       NULL (default): own networks */
} maq_predictor_config;

/* Times of the latest push and prediction, in wall-clock milliseconds, and counts since the predictor was made. */
typedef struct maq_predictor_stats {
  uint32_t struct_size;
  float grey_ms;                /* of the latest push: the frame copied, and its brightness at several sizes */
  float flow_ms;                /* its motion since the frame before */
  float choice_ms;              /* which method was right about it (MAQ_PREDICTION_AUTO) */
  float push_ms;                /* all of it */
  float project_ms;             /* of the latest prediction: where each pixel comes from */
  float fetch_ms;               /* its pixels */
  float predict_ms;             /* all of it */
  maq_prediction_method method; /* of the latest prediction: MAQ_PREDICTION_LAST or MAQ_PREDICTION_MOTION where one made
                                   all of it, else MAQ_PREDICTION_AUTO */
  float motion_fraction;        /* how much of it is motion's, 0 to 1 */
  uint64_t pushed_count;
  uint64_t predicted_count;
  uint64_t reset_count; /* frames that did not go on from the one before, so that it was forgotten */
  /* MAQ_PREDICTION_NETWORK; all else is of what AUTO has: */
  float networks_ms;    /* of the latest push or prediction; 0 where nothing moved, so that none ran */
  uint32_t drawn_count; /* frames drawn for the latest prediction or maq_predictor_draw */
  uint32_t cell_count;  /* of maq_predictor_copy_uncertainty: 256, 16 rows of 16 in the bundles of this SDK; 0 without
                           networks */
  /* Of the latest prediction or maq_predictor_draw: */
  maq_network_mode network_mode; /* whose networks ran; MAQ_NETWORK_AUTO: none, as while nothing moves */
  uint32_t step_count; /* codes drawn one after another: steps from cell to cell, each of all samples; cell_count a
                          frame */
  uint32_t pass_count; /* passes over all cells of a frame at once: 1 of MAQ_NETWORK_MENDED and MAQ_NETWORK_EXPECTED; of
                          codes drawn in passes those of all frames and samples, at most config.passes each */
} maq_predictor_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_predictor_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_predictor_config_init(maq_predictor_config* config, uint32_t struct_size);

/* Makes a predictor for one stream. `config` may be NULL for the defaults. `*predictor` is the caller's, to be given to
 * maq_predictor_destroy. Those of a context that take turns share the memory that they work in: beside it a further one
 * keeps a frame and some 1 MB (of 640 x 480 pixels).
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. With MAQ_PREDICTION_NETWORK a bundle of the task "prediction" is
 * loaded and checked: MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED (a bundle of another task, or
 * without the networks of that mode), MAQ_ERROR_RUNTIME_LIBRARY; blocks while files are read. Else does not block. */
MAQ_API maq_status maq_predictor_create(maq_context* context, const maq_predictor_config* config,
                                        maq_predictor** predictor);

/* Frees the predictor (NULL is fine). Frames that it made stay valid until they are released.
 * Once for each predictor, from any thread. May block briefly. */
MAQ_API void maq_predictor_destroy(maq_predictor* predictor);

/* Shows the stream's next frame to the predictor. It is copied: release it at any time. Time counts by the frames'
 * timestamps, so that frames may be missing. The frames before are forgotten where this one is of another size, format
 * or clock, not later than they are or more than a second later, or shows something else (a cut); one of the same time
 * as the frame before replaces it.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (a depth image), MAQ_ERROR_INFERENCE.
 * Blocks while motion is found, and while a network runs. */
MAQ_API maq_status maq_predictor_push(maq_predictor* predictor, const maq_frame* frame);

/* Makes the picture that the stream will show `ahead_s` seconds after the latest frame, 0 to 10, in that frame's size
 * and format, with that time as its timestamp and that frame's sequence. While one frame is known, and while nothing
 * moves, it is that frame. `*frame` comes from a pool of frame_pool_size: give it back with maq_frame_release.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (also before the first frame), MAQ_ERROR_POOL_EMPTY,
 * MAQ_ERROR_INFERENCE. Blocks while pixels are computed, and networks run. */
MAQ_API maq_status maq_predictor_predict(maq_predictor* predictor, double ahead_s, maq_frame** frame);

/* Draws `sample_count` (1 to 16) of what the stream may show, each `frame_count` (1 to 64) frames, `step_s` apart:
 * above 0, at most 0.125 (networks know steps up to 0.1; the nearest is taken). Of a predictor with
 * MAQ_PREDICTION_NETWORK that draws codes, by its temperature, top_k, seed and passes. A sample goes on from its own
 * frames, and is the same however many others and frames are drawn; the same call after the same frames draws the same.
 * While nothing moves all of them are the last frame. They are known until the next push, prediction, draw or reset.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (also before the first frame), MAQ_ERROR_UNSUPPORTED (a predictor
 * that does not draw), MAQ_ERROR_INFERENCE. Blocks while networks run: each frame of a sample takes as long as one that
 * maq_predictor_predict draws, of several samples at once less. */
MAQ_API maq_status maq_predictor_draw(maq_predictor* predictor, uint32_t sample_count, uint32_t frame_count,
                                      double step_s);

/* Makes the picture of frame `number`, from 1, of a sample that was drawn, from 0; all else as maq_predictor_predict
 * has it for that time. One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (also where it is not known),
 * MAQ_ERROR_POOL_EMPTY, MAQ_ERROR_INFERENCE. Blocks while pixels are computed, and networks run. */
MAQ_API maq_status maq_predictor_acquire_drawn(maq_predictor* predictor, uint32_t sample, uint32_t number,
                                               maq_frame** frame);

/* Writes how uncertain that frame was when it was drawn, after those before it in its sample: the entropy of a code in
 * bits, mean of each cell, stats.cell_count floats row by row from the top left; 0 where nothing moved. A cell is that
 * part of the frame, whatever the frame's shape. `count` is how many have room there.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (too little room; also where it is not known). Does not block. */
MAQ_API maq_status maq_predictor_copy_uncertainty(const maq_predictor* predictor, uint32_t sample, uint32_t number,
                                                  float* bits, size_t count);

/* Forgets the frames so far, as before another stream.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_predictor_reset(maq_predictor* predictor);

/* Gets times and counts. The caller sets stats->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_predictor_get_stats(const maq_predictor* predictor, maq_predictor_stats* stats);

/* How surprising each frame of a stream is after the one before, and where, in bits: to notice what stands out, such as
 * a cut, a frozen or a covered camera, or something that appears, without a list of what may happen. A network makes a
 * frame, squeezed to a small square, codes at columns * rows cells of a map; a table or a second network, and
 * what the stream has shown so far, say how likely each code is. */

typedef struct maq_surprise maq_surprise;

/* Values never change meaning; new ones are added at the end. */
typedef enum maq_surprise_method {
  MAQ_SURPRISE_AUTO = 0, /* the transformer of the bundle, which sees three frames before, where it has one */
  MAQ_SURPRISE_TABLE = 1 /* how often a code followed another: takes next to no time */
} maq_surprise_method;

typedef struct maq_surprise_config {
  uint32_t struct_size;
  int32_t threads;         /* 1 to 64; 0 (default): the machine's large cores, at most 4; MAQ_THREADS_MEASURED: as
                              many of these as pay, measured */
  const char* bundle_path; /* folder with manifest.json; NULL (default): bundle_files, or without them the bundle
                              installed with the library (share/maquette/models/prediction-int8). Copied. */
  const maq_memory_file* bundle_files; /* the bundle's files in memory, instead of bundle_path; default NULL. Copied. */
  uint32_t bundle_file_count;          /* default 0 */
  int32_t allow_spinning;              /* 1 (default): idle threads spin for a while; 0: they sleep, which saves energy
                                          and costs some speed */
  const maq_surprise* networks_of;     /* another stream, whose networks this one uses as well: it takes little memory
                                          then, and frames of both are encoded one after the other. What is said above
                                          is not read. The other may be destroyed first. NULL (default): own networks */
  float event_ratio; /* a frame is an event from this ratio on, and from 1 / it down; above 1, at most 1e6; default 4 */
  maq_surprise_method method; /* what says how likely codes are; default MAQ_SURPRISE_AUTO. With networks_of:
                                 MAQ_SURPRISE_AUTO has the transformer where the other stream has it */
} maq_surprise_config;

/* Of one frame. */
typedef struct maq_surprise_score {
  uint32_t struct_size;
  int32_t columns; /* of the map */
  int32_t rows;
  float bits;  /* a code, mean of the frame: some hundredths where nothing changes, 1 to 3 where much moves, over 8
                  where nothing was foreseen */
  float ratio; /* bits by the median of the 8 frames before: 1 is as usual, 6 six times as surprising, 1/6 a sixth, as
                  of a stream that freezes. Both with 0.035 added, so that noise counts little. 1 while fewer than
                  4 are known */
  int32_t is_event; /* 1: a cut, or ratio is event_ratio or more, or 1 / event_ratio or less */
  int32_t is_cut;   /* 1: nothing in it follows from the frame before, as at a cut or a black-out: its codes are no more
                       likely after that than by themselves. The ratios of the frames that follow begin anew */
  int32_t is_start; /* 1: the frame does not go on from the one before, and bits say how rare its codes are: the first;
                       another size, format or clock; an earlier time; over a second later */
} maq_surprise_score;

/* Times of the latest frame, in wall-clock milliseconds, and counts since the stream was made. */
typedef struct maq_surprise_stats {
  uint32_t struct_size;
  float resize_ms; /* the frame to the network's square */
  float network_ms;
  float nearest_ms; /* codes of what the network says */
  float push_ms;    /* all of it, and the bits */
  int32_t threads;  /* of the network */
  uint64_t pushed_count;
  uint64_t event_count;
  uint64_t start_count;
  float transformer_ms; /* of the latest frame: how likely its codes are; 0 where the table said that */
} maq_surprise_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_surprise_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_surprise_config_init(maq_surprise_config* config, uint32_t struct_size);

/* Loads a model bundle of the task "prediction" and checks its files' sizes and SHA-256, for one stream. `config` may
 * be NULL for the defaults. `*surprise` is the caller's, to be given to maq_surprise_destroy. Any thread. Errors:
 * MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED (a bundle of another
 * task), MAQ_ERROR_RUNTIME_LIBRARY. Blocks while files are read, and while threads are measured. */
MAQ_API maq_status maq_surprise_create(maq_context* context, const maq_surprise_config* config,
                                       maq_surprise** surprise);

/* Frees the stream (NULL is fine), and its networks with the last stream that uses them.
 * Once for each handle, from any thread. May block briefly. */
MAQ_API void maq_surprise_destroy(maq_surprise* surprise);

/* Shows the stream's next frame, of any size and format but depth, which is not kept, and says how surprising it is.
 * The caller sets score->struct_size. After an error the stream is as it was before the frame. One at a time. Errors:
 * MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (a depth image), MAQ_ERROR_INFERENCE. Blocks while the network
 * runs, and while frames of streams with the same networks are encoded. */
MAQ_API maq_status maq_surprise_push(maq_surprise* surprise, const maq_frame* frame, maq_surprise_score* score);

/* Writes the map of the latest frame to `bits`, columns * rows floats row by row from the top left: the bits of a code,
 * mean of the cell, whose mean is score.bits. A cell is that part of the frame, whatever the frame's shape. `count` is
 * how many have room there.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (too little room; before the first frame). Does not block. */
MAQ_API maq_status maq_surprise_copy_map(const maq_surprise* surprise, float* bits, size_t count);

/* Makes the picture that the codes of the latest frame stand for: what the network saw of it. What is not in it cannot
 * be surprising. RGB, square (64 x 64 pixels in the bundles of this SDK) whatever the frame's shape, with the frame's
 * time; maq_frame_get_origin says MAQ_FRAME_PREDICTED, as of every frame that no camera took, with a horizon of 0. The
 * first call opens a second network. `*frame` comes from a pool of 4: give it back with maq_frame_release. One at a
 * time. Errors: MAQ_ERROR_INVALID_ARGUMENT (also before the first frame), MAQ_ERROR_POOL_EMPTY, MAQ_ERROR_BAD_BUNDLE,
 * MAQ_ERROR_INFERENCE. Blocks while the network runs. */
MAQ_API maq_status maq_surprise_acquire_rebuilt(maq_surprise* surprise, maq_frame** frame);

/* Forgets the frames so far, as before another stream.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_surprise_reset(maq_surprise* surprise);

/* Gets times and counts. The caller sets stats->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_surprise_get_stats(const maq_surprise* surprise, maq_surprise_stats* stats);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_PREDICTION_H_ */
