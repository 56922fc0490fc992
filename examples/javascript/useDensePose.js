// A hook for React: dense pose of a <video>, frame after frame, as long as the component is shown.
//
//   const video = useRef(null);
//   const { result, error } = useDensePose(video, { keypoints: true });
//   return <><video ref={video} autoPlay muted playsInline /><p>{error?.message ?? `${result?.people.length ?? 0} people`}</p></>;
import { useEffect, useState } from 'react';
import { DensePose } from 'maquette';

export function useDensePose(video, options) {
  const [state, setState] = useState({ result: null, error: null });
  const settings = JSON.stringify(options ?? {});

  useEffect(() => {
    let isShown = true;
    let densepose = null;
    async function follow() {
      densepose = await DensePose.load(JSON.parse(settings));
      while (isShown) {
        const time = await new Promise((resolve) => video.current.requestVideoFrameCallback(resolve));
        if (!isShown) return;
        setState({ result: await densepose.run(video.current, { timeMs: time }), error: null });
      }
    }
    follow()
      .catch((error) => isShown && setState({ result: null, error }))
      .finally(() => densepose?.close());
    return () => {
      isShown = false;
    };
  }, [video, settings]);

  return state;
}
