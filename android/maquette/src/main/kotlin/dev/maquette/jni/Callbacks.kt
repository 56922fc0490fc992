package dev.maquette.jni

import dev.maquette.Head
import dev.maquette.HeadPreview
import dev.maquette.MaquetteException
import dev.maquette.Progress
import java.util.concurrent.ConcurrentHashMap
import java.util.concurrent.atomic.AtomicLong

/** Called by native code (src/main/cpp/jni_callbacks.cpp), by the names of the functions, on any thread. */
internal object Callbacks {
    private val objects = ConcurrentHashMap<Long, Any>()
    private val lastId = AtomicLong()
    private val callOfThread = ThreadLocal<Call?>()

    private class Call(val progress: Progress?, val preview: HeadPreview?) {
        var thrown: Throwable? = null

        fun <T> catching(failed: T, work: () -> T): T {
            if (thrown != null) return failed
            return try {
                work()
            } catch (error: Throwable) {
                thrown = error
                failed
            }
        }
    }

    /** Keeps an object for the native object that [create] makes, until [release]. [create] gets its number. */
    fun <T> keep(kept: Any, create: (id: Long) -> T): T {
        val id = lastId.incrementAndGet()
        objects[id] = kept
        try {
            return create(id)
        } catch (error: Throwable) {
            release(id)
            throw error
        }
    }

    fun release(id: Long) {
        objects.remove(id)
    }

    /**
     * Runs a call that tells [progress] and [preview]. If one of these throws, the call is cancelled, and this throws
     * the exception; a result that came nevertheless is discarded.
     */
    fun <T> during(progress: Progress?, preview: HeadPreview? = null, discard: (T) -> Unit = {}, work: () -> T): T {
        val outer = callOfThread.get() // a progress may begin another call
        val call = Call(progress, preview)
        callOfThread.set(call)
        val result =
            try {
                work()
            } catch (error: MaquetteException) {
                throw call.thrown ?: error
            } finally {
                callOfThread.set(outer)
            }
        call.thrown?.let { thrown ->
            discard(result)
            throw thrown
        }
        return result
    }

    @JvmStatic
    fun onState(id: Long, state: Int, status: Int, text: Long) {
        (objects[id] as? Changes<*>)?.onChange(state, status, textAt(text))
    }

    @JvmStatic
    fun onProgress(done: Double, stage: Long): Boolean {
        val call = callOfThread.get() ?: return true
        return call.catching(false) { call.progress?.onProgress(done, textAt(stage)) ?: true }
    }

    @JvmStatic
    fun onPreview(head: Long) {
        val call = callOfThread.get()
        // Without a preview, another thread has set one, whose fit is refused while this one runs.
        val preview = call?.preview?.takeIf { call.thrown == null } ?: return Native.maq_head_destroy(head)
        call.catching(Unit) { preview.onPreview(Head(head)) }
    }

    @JvmStatic fun onRelease(id: Long) = release(id)
}

/**
 * Changes of state of one native object. Each listener gets the latest one, then all that follow, in order, and null at
 * the end. Listeners are called on threads of the library and must return at once.
 *
 * It must not refer to the object itself: [Callbacks] keeps it until the object is destroyed.
 */
internal class Changes<T : Any>(private val convert: (state: Int, status: Int, text: String) -> T) {
    private val listeners = LinkedHashSet<(T?) -> Unit>()
    private var latest: T? = null
    private var isEnded = false

    fun onChange(state: Int, status: Int, text: String) = tell(convert(state, status, text))

    @Synchronized
    fun tell(change: T) {
        if (isEnded) return
        latest = change
        listeners.forEach { it(change) }
    }

    @Synchronized
    fun end() {
        isEnded = true
        listeners.forEach { it(null) }
        listeners.clear()
    }

    @Synchronized
    fun listen(listener: (T?) -> Unit) {
        latest?.let(listener)
        if (isEnded) listener(null) else listeners.add(listener)
    }

    @Synchronized
    fun leave(listener: (T?) -> Unit) {
        listeners.remove(listener)
    }
}
