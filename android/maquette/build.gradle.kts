plugins {
    id("com.android.library")
    kotlin("android")
    `maven-publish`
}

group = "dev.maquette"
version = "0.3.0"

android {
    namespace = "dev.maquette"
    compileSdk = 35
    ndkVersion = "28.2.13676358"

    defaultConfig {
        minSdk = 26
        consumerProguardFiles("consumer-rules.pro")
        ndk { abiFilters += listOf("arm64-v8a", "x86_64") }
        externalNativeBuild {
            cmake { arguments += listOf("-DANDROID_STL=c++_static", "-DANDROID_SUPPORT_FLEXIBLE_PAGE_SIZES=ON") }
        }
    }
    externalNativeBuild {
        cmake {
            path = file("src/main/cpp/CMakeLists.txt")
            version = "3.31.6"
        }
    }
    compileOptions {
        sourceCompatibility = JavaVersion.VERSION_17
        targetCompatibility = JavaVersion.VERSION_17
    }
    // The shipped networks: ModelBundle.ofAssets(assets, "densepose-b-int8").
    sourceSets["main"].assets.srcDir("../../sdk/models")
    publishing { singleVariant("release") { withSourcesJar() } }
}

kotlin { jvmToolchain(17) }

dependencies {
    // In the API: Flows.kt returns its Flow. Apps in Kotlin nearly all have it, and a shrinker removes it where no flow is
    // used. 1.10.2 fits Kotlin 2.2.
    api("org.jetbrains.kotlinx:kotlinx-coroutines-core:1.10.2")
}

publishing {
    publications {
        register<MavenPublication>("release") {
            artifactId = "maquette"
            afterEvaluate { from(components["release"]) }
            pom {
                name = "Maquette"
                description = "On-device vision: dense pose and scenes from a camera, on the CPU"
                licenses {
                    license {
                        name = "Apache-2.0"
                        url = "https://www.apache.org/licenses/LICENSE-2.0"
                    }
                }
            }
        }
    }
}
