package dev.maquette.sample

import android.os.Build
import android.os.Process
import dev.maquette.DensePose
import dev.maquette.DensePoseResult
import dev.maquette.Frame
import dev.maquette.Maquette
import dev.maquette.ModelBundle
import dev.maquette.Source
import java.io.File
import org.json.JSONArray
import org.json.JSONObject

/** One source with the times of its frames. */
class TimedSource(private val maquette: Maquette, val uri: String) : AutoCloseable {
    private val times = Array(STAGES.size) { mutableListOf<Double>() }
    private var source = maquette.source(uri)
    private var cpuMs = 0L
    private var people = 0
    private var stats: DensePoseResult.Stats? = null
    private var size = 0 to 0

    val runs get() = times[0].size

    /** Takes the next frame, from the start again after the last, and finds its people. */
    fun run(densePose: DensePose, isCounted: Boolean) {
        val cpu = Process.getElapsedCpuTime()
        val start = System.nanoTime()
        val frame = next()
        val taken = System.nanoTime()
        frame.use {
            densePose.run(it).use { result ->
                val done = System.nanoTime()
                val s = result.stats
                stats = s
                size = it.widthPx to it.heightPx
                if (!isCounted) return
                listOf(
                    ms(taken - start), s.preprocessMs, s.trunkMs, s.proposalsMs, s.boxHeadMs, s.denseHeadMs, s.cropsMs,
                    s.decodeMs, ms(done - start),
                ).forEachIndexed { stage, value -> times[stage].add(value) }
                cpuMs += Process.getElapsedCpuTime() - cpu
                people += s.people
            }
        }
    }

    /** Returns a percentile of the times of a stage, interpolated. The stage "frame" is the whole frame. */
    fun percentile(stage: String, percent: Int): Double {
        val sorted = times[STAGES.indexOf(stage)].sorted()
        val at = percent / 100.0 * (sorted.size - 1)
        val low = at.toInt()
        val high = minOf(low + 1, sorted.size - 1)
        return sorted[low] + (sorted[high] - sorted[low]) * (at - low)
    }

    /** An entry of `cases` (docs/reference/formats.md, "Benchmarks"). */
    fun json(): JSONObject {
        val s = stats!!
        val seconds = times.last().sum() / 1000
        val spread = percentile("frame", 90) / percentile("frame", 50)
        val warnings = JSONArray()
        if (spread > MAX_SPREAD) warnings.put("p90 is %.2f times p50, %.2f allowed".format(spread, MAX_SPREAD))
        val ms = JSONObject()
        for (stage in STAGES) {
            ms.put(stage, JSONObject(listOf(50, 90, 99).associate { "p$it" to percentile(stage, it) }))
        }
        return JSONObject()
            .put("source", uri)
            .put("size_px", JSONArray(listOf(size.first, size.second)))
            .put("network_px", JSONArray(listOf(s.networkWidthPx, s.networkHeightPx)))
            .put("provider", s.provider.name.lowercase())
            .put("threads", s.threads)
            .put("threads_measured", s.isThreadsMeasured)
            .put("runs", runs)
            .put("seconds", seconds)
            .put("people", people.toDouble() / runs)
            .put("proposals", s.proposals)
            .put("dropped_frames", 0)
            .put("ms", ms)
            .put("fps", 1000 / percentile("frame", 50))
            .put("cpu_ms", cpuMs.toDouble() / runs)
            .put("cores_busy", cpuMs / 1000.0 / seconds)
            .put("valid", warnings.length() == 0)
            .put("warnings", warnings)
    }

    override fun close() = source.close()

    private fun next(): Frame {
        source.acquireFrame()?.let { return it }
        source.close()
        source = maquette.source(uri, Source.Config())
        return checkNotNull(source.acquireFrame()) { "$uri has no frames." }
    }

    private fun ms(ns: Long) = ns / 1e6

    private companion object {
        val STAGES =
            listOf("capture", "preprocess", "trunk", "proposals", "box_head", "dense_head", "crops", "decode", "frame")
        const val MAX_SPREAD = 1.5
    }
}

/** Measures on this device what `maquette bench` measures: the same sources, and the same report. */
class Benchmark(private val maquette: Maquette, private val bundle: ModelBundle) {
    /**
     * Takes some seconds.
     *
     * @param runs frames of each source; ten more before them are not counted.
     * @param progress of the fraction that is done.
     */
    fun run(sources: List<String> = SOURCES, runs: Int = 100, progress: (Double) -> Unit = {}): JSONObject {
        val start = System.nanoTime()
        val densePose = maquette.densePose(bundle)
        val createMs = (System.nanoTime() - start) / 1e6
        val cases = sources.map { TimedSource(maquette, it) }
        try {
            val first = System.nanoTime()
            cases.first().run(densePose, isCounted = false)
            val firstMs = (System.nanoTime() - first) / 1e6
            for (case in cases) repeat(WARM_UP) { case.run(densePose, isCounted = false) }
            // In turns, so that a phone that gets warm is equally warm for all.
            while (cases.last().runs < runs) {
                for (case in cases) repeat(minOf(BLOCK, runs - case.runs)) { case.run(densePose, isCounted = true) }
                progress(cases.last().runs.toDouble() / runs)
            }
            return report(cases, runs, createMs, firstMs)
        } finally {
            cases.forEach(TimedSource::close)
            densePose.close()
        }
    }

    private fun report(cases: List<TimedSource>, runs: Int, createMs: Double, firstMs: Double) = JSONObject()
        .put("schema", "maquette-bench-3")
        .put("machine", machine())
        .put("build", JSONObject().put("sdk", Maquette.version).put("onnxruntime", maquette.onnxRuntimeVersion))
        .put("settings", JSONObject().put("warm_up", WARM_UP).put("runs", runs))
        .put("create_ms", createMs)
        .put("first_frame_ms", firstMs)
        .put("peak_memory_mib", peakMemoryMib())
        .put("valid", cases.all { it.json().getBoolean("valid") })
        .put("warnings", JSONArray())
        .put("cases", JSONArray(cases.map(TimedSource::json)))

    private fun machine() =
        JSONObject()
            .put("processor", "${Build.MANUFACTURER} ${Build.MODEL}")
            .put("architecture", Build.SUPPORTED_ABIS.firstOrNull() ?: System.getProperty("os.arch"))
            .put("cores", Runtime.getRuntime().availableProcessors())
            .put("system", "Android ${Build.VERSION.RELEASE}")

    private fun peakMemoryMib(): Double {
        val line = File("/proc/self/status").readLines().first { it.startsWith("VmHWM") }
        return line.filter(Char::isDigit).toLong() / 1024.0
    }

    private companion object {
        val SOURCES = listOf("stub:people?count=1", "stub:people?count=4", "stub:people?count=0")
        const val WARM_UP = 10
        const val BLOCK = 10
    }
}
