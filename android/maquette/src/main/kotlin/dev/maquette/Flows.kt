package dev.maquette

import dev.maquette.jni.Changes
import java.util.concurrent.atomic.AtomicReference
import kotlinx.coroutines.Dispatchers
import kotlinx.coroutines.channels.Channel
import kotlinx.coroutines.channels.awaitClose
import kotlinx.coroutines.flow.Flow
import kotlinx.coroutines.flow.buffer
import kotlinx.coroutines.flow.callbackFlow
import kotlinx.coroutines.flow.flow
import kotlinx.coroutines.flow.flowOn
import kotlinx.coroutines.flow.map
import kotlinx.coroutines.withContext

/** How long a wait on a thread of [Dispatchers.IO] goes on after its flow was cancelled, at most. */
private const val CANCELLATION_MS = 50L

/**
 * The frames, until the source ends or is stopped. Each is the collector's, to be closed by it:
 *
 *     source.frames().collect { frame -> frame.use { show(it) } }
 *
 * Waiting and decoding happen on [Dispatchers.IO]. Cancelling the collector ends a wait within 50 ms and closes a frame
 * that it was not given yet; the source stays open and can be collected again, by one collector at a time. Do not use
 * operators that drop frames or keep them back (`buffer`, `conflate`, `flowOn`, `collectLatest`): they do not close what
 * they drop, and the pool stays empty until the garbage is collected. Of a camera the newest frame comes in any case.
 *
 * Fails with what [Source.acquireFrame] throws, but for [Status.TIMEOUT].
 */
fun Source.frames(): Flow<Frame> = acquired(::acquireFrame)

/** As [frames] of a source, for a source whose gaps are bridged; [Frame.origin] tells which frames are made up. */
fun Concealer.frames(): Flow<Frame> = acquired(::acquireFrame)

/**
 * The results, until the source ends or the pipeline is stopped: begin to collect after [Pipeline.setSource]. Each is
 * the collector's, to be closed by it, and what is said of [frames] holds here too. Results that come while the collector
 * is busy replace each other: the newest comes next.
 *
 * Fails with what [Pipeline.acquireResult] throws, but for [Status.TIMEOUT].
 */
fun Pipeline.results(): Flow<PipelineResult> = acquired(::acquireResult)

/**
 * The latest change of state of a camera, or of a source in real time, then each that follows, until it is closed.
 *
 * Nothing is polled: a thread of the library tells of a change. Collectors run in their own context, and may close the
 * source.
 */
fun Source.changes(): Flow<Source.Change> = stateChanges.asFlow()

/** The state, then each change, until the pipeline is closed; threads as for [Source.changes]. */
fun Pipeline.changes(): Flow<Pipeline.Change> = stateChanges.asFlow()

private fun <T : AutoCloseable> acquired(acquire: (timeoutMs: Long) -> T?): Flow<T> =
    flow {
        // Cancellation can fall on any step between acquiring an item and the collector's code: until that has taken
        // the item out, it is ours to close.
        val untaken = AtomicReference<T?>()
        var isOpen = false
        try {
            do {
                var isEnded = false
                withContext(Dispatchers.IO) {
                    try {
                        untaken.set(acquire(CANCELLATION_MS))
                        isEnded = untaken.get() == null
                    } catch (error: MaquetteException) {
                        if (error.status != Status.TIMEOUT) throw error
                    } catch (error: IllegalStateException) {
                        if (!isOpen) throw error
                        isEnded = true // closed between two waits, which ends as if it were closed during one
                    }
                }
                isOpen = true
                if (untaken.get() != null) emit(untaken)
            } while (!isEnded)
        } finally {
            untaken.get()?.close()
        }
    }.map { untaken -> untaken.getAndSet(null)!! }

private fun <T : Any> Changes<T>.asFlow(): Flow<T> =
    callbackFlow {
        val listener: (T?) -> Unit = { change -> if (change == null) channel.close() else trySend(change) }
        listen(listener)
        awaitClose { leave(listener) }
    }.buffer(Channel.UNLIMITED)
        .map { it } // so that flowOn makes a channel of its own, and no collector's code runs on the library's thread
        .flowOn(Dispatchers.Default)
